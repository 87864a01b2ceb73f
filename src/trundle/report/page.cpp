#include "trundle/report/page.hpp"

#include <array>
#include <cassert>

#include <nlohmann/json.hpp>

#include "trundle/report/json_text.hpp"
#include "trundle/report/result_json.hpp"

namespace trundle::report {

std::string json_for_script(const nlohmann::ordered_json& document) {
  std::string escaped;
  for (const char c : dumped(document)) {
    if (c == '<') {
      escaped += "\\u003c";  // '<' occurs only inside strings, where this means the same
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string report_page(const nlohmann::ordered_json& report) {
  std::string page(page_template());
  const std::size_t mark = page.find(kDataMark);
  assert(mark != std::string::npos);
  return page.replace(mark, kDataMark.size(), json_for_script(report));
}

std::string calibration_page(const nlohmann::ordered_json& calibration) {
  const std::array results = {result_of_calibration(calibration)};
  return report_page(report_json(results, nullptr));
}

}  // namespace trundle::report
