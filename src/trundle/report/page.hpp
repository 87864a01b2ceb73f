#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// One HTML file that shows results: style, drawing (web/, inlined when the library is built) and data in
/// one; it fetches nothing and opens from disk. Whatever stands in the strings of report_json() is shown as
/// text, never read as markup.
[[nodiscard]] std::string report_page(const nlohmann::ordered_json& report);

/// The page of one calibration.
[[nodiscard]] std::string calibration_page(const nlohmann::ordered_json& calibration);

/// JSON as it may stand inside <script type="application/json">: every '<' escaped, so that neither </script>
/// nor <!-- can occur. Parses back to the same value.
[[nodiscard]] std::string json_for_script(const nlohmann::ordered_json& document);

/// The page before the data: web/index.html with style and modules inlined. Holds kDataMark once.
[[nodiscard]] std::string_view page_template();
inline constexpr std::string_view kDataMark = "{{data}}";

}  // namespace trundle::report
