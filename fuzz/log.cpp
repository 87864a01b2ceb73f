// A log of any format, told by its first bytes: every field of every message.
#include "trundle/logs/survey.hpp"

#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle;
  static const fuzz::Folder folder;
  folder.write("log", fuzz::text_of(data, size));
  logs::Limits limits;
  limits.largest_message = limits.largest_chunk = 1 << 20;
  return fuzz::try_to([&] {
    const std::unique_ptr<logs::Log> log = logs::open_log(folder.path() / "log", limits);
    const logs::LogSummary summary = logs::survey(*log, {.fields = true});
    for (const logs::TopicSummary& topic : summary.topics) fuzz::require(topic.start_ns <= topic.end_ns);
  });
}
