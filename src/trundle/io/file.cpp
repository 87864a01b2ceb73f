#include "trundle/io/file.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include "trundle/io/error.hpp"

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
  if (const auto size = std::filesystem::file_size(path, error); !error)
    text.reserve(size);  // it may grow yet
  std::array<char, 1 << 16> chunk;
  do {
    in.read(chunk.data(), chunk.size());
    text.append(chunk.data(), static_cast<std::size_t>(in.gcount()));
  } while (in);
  if (in.bad()) throw InputError(path.string(), std::strerror(errno), "a readable file");
  return text;
}

namespace {

/// Ctrl-C and its like wait for as long as this lives: what is being written is not left lying about.
class SignalsWait {
 public:
  SignalsWait() {
    sigset_t ends;
    sigemptyset(&ends);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ends, signal);
    pthread_sigmask(SIG_BLOCK, &ends, &before_);
  }
  ~SignalsWait() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsWait(const SignalsWait&) = delete;
  SignalsWait& operator=(const SignalsWait&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace

void write_file(const std::filesystem::path& path, std::string_view content) {
  const SignalsWait signals_wait;
  std::error_code error;
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error))
    throw InputError(path.string(), std::filesystem::is_directory(path, error) ? "is a folder" : "is no file",
                     "a place that can be written");
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
  std::filesystem::path temporary = path;
  temporary += fmt::format(".{}.tmp", ::getpid());
  {
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    out.flush();
    if (!out) {
      const std::string reason = std::strerror(errno);
      std::filesystem::remove(temporary, error);
      throw InputError(path.string(), reason, "a place that can be written");
    }
  }
  std::filesystem::rename(temporary, path, error);
  if (error) {
    const std::string reason = error.message();
    std::filesystem::remove(temporary, error);
    throw InputError(path.string(), reason, "a place that can be written");
  }
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
