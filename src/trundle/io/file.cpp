#include "trundle/io/file.hpp"

#include <cerrno>
#include <cstring>

#include "trundle/io/error.hpp"
#include "trundle/io/interruption.hpp"
#include "trundle/io/pieces.hpp"
#include "trundle/io/sha256.hpp"
#include "trundle/io/staging.hpp"

namespace trundle::io {

FilePieces::FilePieces(const std::filesystem::path& path) : path_(path) {
  constexpr std::size_t kPiece = 1 << 18;  // bytes: calls cost nothing beside what is done with so many
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (is_directory(status)) throw InputError(path.string(), "is a folder", "a file");
  if (exists(status) && !is_regular_file(status))  // a pipe may keep silent, /dev/zero never ends
    throw InputError(path.string(), "is no file", "a readable file");
  in_.open(path, std::ios::binary);
  if (!in_) throw InputError(path.string(), std::strerror(errno), "a readable file");
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error) size_ = size;
  piece_.resize(kPiece);
}

std::string_view FilePieces::next() {
  check_interruption();
  if (!in_) return {};
  in_.read(piece_.data(), static_cast<std::streamsize>(piece_.size()));
  if (in_.bad()) throw InputError(path_.string(), std::strerror(errno), "a readable file");
  return {piece_.data(), static_cast<std::size_t>(in_.gcount())};
}

std::string read_file(const std::filesystem::path& path) {
  FilePieces pieces(path);
  std::string text;
  text.reserve(pieces.size());
  for (std::string_view piece = pieces.next(); !piece.empty(); piece = pieces.next()) text += piece;
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
  FilePieces pieces(path);
  for (std::string_view piece = pieces.next(); !piece.empty(); piece = pieces.next()) sha.add(piece);
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
