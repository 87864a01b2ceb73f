#include "trundle/io/file.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <openssl/evp.h>

#include "trundle/io/error.hpp"
#include "trundle/io/staging.hpp"

namespace trundle::io {

std::string read_file(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (is_directory(status)) throw InputError(path.string(), "is a folder", "a file");
  if (exists(status) && !is_regular_file(status))  // a pipe may keep silent, /dev/zero never ends
    throw InputError(path.string(), "is no file", "a readable file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path.string(), std::strerror(errno), "a readable file");
  std::string text;
  std::array<char, 1 << 16> chunk;
  do {
    in.read(chunk.data(), chunk.size());
    text.append(chunk.data(), static_cast<std::size_t>(in.gcount()));
  } while (in);
  if (in.bad()) throw InputError(path.string(), std::strerror(errno), "a readable file");
  return text;
}

void write_file(const std::filesystem::path& path, std::string_view content) {
  write_set({{path, content}});
}

std::string sha256_of(std::string_view content) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int length = 0;
  EVP_Digest(content.data(), content.size(), digest.data(), &length, EVP_sha256(), nullptr);
  std::string hex;
  for (unsigned int i = 0; i < length; ++i) hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

InputFile input_file(const std::filesystem::path& path) {
  return {path.string(), sha256_of(read_file(path))};
}

void require_apart(const std::vector<InputFile>& inputs, const std::vector<std::filesystem::path>& outputs) {
  std::error_code cannot_tell;  // one of them is not there
  for (const std::filesystem::path& output : outputs)
    for (const InputFile& input : inputs)
      if (std::filesystem::equivalent(output, input.path, cannot_tell))
        throw InputError(output.string(), "is an input, which would be lost", "another place for results");
}

}  // namespace trundle::io
