#include "trundle/io/checkpoint.hpp"

#include <sstream>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

namespace trundle::io {
namespace {

/// Rises whenever a state's bytes mean something else than before.
constexpr int kFormat = 16;

}  // namespace

void write_checkpoint(const std::filesystem::path& path, std::string_view kind, std::string_view state) {
  std::string content = fmt::format("trundle checkpoint {} {} {}\n", kFormat, kind, sha256_of(state));
  content += state;
  write_file(path, content);
}

std::string read_checkpoint(const std::filesystem::path& path, std::string_view kind) {
  std::string content = read_file(path);
  const std::size_t head = content.find('\n');
  std::istringstream words(content.substr(0, std::min<std::size_t>(head, 200)));
  std::string program, what, its_kind, hash;
  int format = 0;
  words >> program >> what >> format >> its_kind >> hash;
  if (!words || program != "trundle" || what != "checkpoint" || head == std::string::npos)
    throw InputError(path.string(), "is no checkpoint", "a file that --checkpoint wrote");
  if (format != kFormat)
    throw InputError(path.string(), fmt::format("is a checkpoint of format {}", format),
                     fmt::format("format {}, which this version writes", kFormat));
  if (its_kind != kind)
    throw InputError(path.string(), fmt::format("is a checkpoint of '{}'", its_kind),
                     fmt::format("one of '{}'", kind));
  content.erase(0, head + 1);
  if (sha256_of(content) != hash)
    throw InputError(path.string(), "is damaged or cut short", "the bytes that its first line was made for");
  return content;
}

}  // namespace trundle::io
