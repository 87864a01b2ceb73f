// A folder of results as `trundle report` reads it: JSON and CSV. The document of the page parses back.
#include <nlohmann/json.hpp>

#include "trundle/pipeline/report_answer.hpp"
#include "trundle/report/json_text.hpp"

#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle;
  static const fuzz::Folder folder;
  folder.clear();
  folder.write_all(fuzz::text_of(data, size));
  std::string document;
  fuzz::try_to([&] { document = report::dumped(pipeline::answer_report({{folder.path()}}).document); });
  if (!document.empty()) fuzz::require(nlohmann::json::accept(document));
  return 0;
}
