#include "trundle/io/file.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "trundle/io/error.hpp"
#include "trundle/io/pieces.hpp"
#include "trundle/io/sha256.hpp"
#include "trundle/io/staging.hpp"

namespace trundle::io {

namespace {

/// Hands the bytes of a file on, piece by piece. Throws InputError when it cannot be read to its end, or is
/// no file.
template <typename Take>
void read_pieces(const std::filesystem::path& path, const Take& take) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (is_directory(status)) throw InputError(path.string(), "is a folder", "a file");
  if (exists(status) && !is_regular_file(status))  // a pipe may keep silent, /dev/zero never ends
    throw InputError(path.string(), "is no file", "a readable file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path.string(), std::strerror(errno), "a readable file");
  std::array<char, 1 << 16> piece;
  do {
    in.read(piece.data(), piece.size());
    take(std::string_view(piece.data(), static_cast<std::size_t>(in.gcount())));
  } while (in);
  if (in.bad()) throw InputError(path.string(), std::strerror(errno), "a readable file");
}

}  // namespace

std::string read_file(const std::filesystem::path& path) {
  std::string text;
  std::error_code error;
  if (const auto size = std::filesystem::file_size(path, error); !error)
    text.reserve(size);  // it may grow yet
  read_pieces(path, [&](std::string_view piece) { text += piece; });
  return text;
}

void write_file(const std::filesystem::path& path, std::string_view content) {
  write_set({{path, content}});
}

void write_file(const std::filesystem::path& path, const std::function<void(const TakeText&)>& produce) {
  write_set({{path, {}, produce}});
}

std::string sha256_of(std::string_view content) {
  Sha256 sha;
  sha.add(content);
  return sha.hex();
}

/// A log may be larger than what is kept of it: its bytes are never all in memory.
InputFile input_file(const std::filesystem::path& path) {
  Sha256 sha;
  read_pieces(path, [&](std::string_view piece) { sha.add(piece); });
  return {path.string(), sha.hex()};
}

void require_apart(const std::vector<InputFile>& inputs, const std::vector<std::filesystem::path>& outputs) {
  std::error_code cannot_tell;  // one of them is not there
  for (const std::filesystem::path& output : outputs)
    for (const InputFile& input : inputs)
      if (std::filesystem::equivalent(output, input.path, cannot_tell))
        throw InputError(output.string(), "is an input, which would be lost", "another place for results");
}

}  // namespace trundle::io
