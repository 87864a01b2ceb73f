#include "trundle/report/page.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "trundle/io/file.hpp"
#include "trundle/report/calibration_json.hpp"
#include "trundle/report/result_json.hpp"

#include "report/example_result.hpp"

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;
using testing::Not;

Json hostile_calibration() {
  CalibrationResult result = test::example_with_held_parameter();
  result.nominal.name = "</script><script>alert(1)</script><!-- <script";
  result.runs[0].name = "<img src=x onerror=alert(1)> \"'` 🤖 \xff";
  result.runs[1].name = std::string(10000, 'x');
  result.parameters[0].name = "{{data}}]]></SCRIPT >";
  result.warnings.push_back("--> \\u003c \u2028 \u2029");
  return calibration_json(result, Json::object());
}

std::size_t count(std::string_view text, std::string_view part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++found;
  return found;
}

/// What stands between two marks of a page.
std::string between(std::string_view page, std::string_view start, std::string_view end) {
  const std::size_t from = page.find(start) + start.size();
  return std::string(page.substr(from, page.find(end, from) - from));
}

Json data_in(std::string_view page) {
  return Json::parse(between(page, "<script type=\"application/json\" id=\"data\">", "</script>"));
}

std::string script_in(std::string_view page) {
  return between(page, "<script type=\"module\">", "</script>");
}

TEST(Page, HoldsTheDataAndGivesItBackAsItWas) {
  const Json calibration = calibration_json(test::example_result(), {{"version", "1.2.3"}});
  const Json data = data_in(calibration_page(calibration));
  EXPECT_EQ(data["results"][0]["calibration"], calibration);
}

TEST(Page, HoldsSeveralResultsAndItsOwnProvenance) {
  const Json calibration = calibration_json(test::example_result(), Json::object());
  const std::array results = {result_of_calibration(calibration), result_of_calibration(calibration)};
  const Json report = report_json(results, {{"program", "trundle"}});
  EXPECT_EQ(data_in(report_page(report)), report);
  EXPECT_EQ(report["results"].size(), 2);
  EXPECT_EQ(report["provenance"]["program"], "trundle");
}

TEST(Page, HostileTextIsData) {
  const Json calibration = hostile_calibration();
  const std::string page = calibration_page(calibration);
  EXPECT_EQ(data_in(page)["results"][0]["calibration"], calibration);
  EXPECT_EQ(count(page, "<script"), count(page_template(), "<script"));
  EXPECT_EQ(count(page, "</script"), count(page_template(), "</script"));
  EXPECT_EQ(count(page, "<!--"), 0);
  EXPECT_EQ(count(page, "<img"), 0);
}

TEST(Page, JsonForScriptHasNoOpeningBracketAndMeansTheSame) {
  const Json document = {{"<a>", "</script>"}, {"b", {"<!--", 1.5, nullptr}}};
  const std::string text = json_for_script(document);
  EXPECT_EQ(text.find('<'), text.npos);
  EXPECT_EQ(Json::parse(text), document);
}

TEST(Page, TheTemplateHasOnePlaceForData) {
  EXPECT_EQ(count(page_template(), kDataMark), 1);
  EXPECT_THAT(calibration_page(hostile_calibration()), HasSubstr("{{data}}]]>"));
}

TEST(Page, FetchesNothing) {
  const std::string page(page_template());
  for (const char* part : {"http:", "https:", "//cdn", "@import", "url(", "fetch(", "XMLHttpRequest",
                           "WebSocket", "import(", "<link", "<iframe", "<img"})
    EXPECT_THAT(page, Not(HasSubstr(part)));
  for (const std::string_view attribute : {"src", "href"})
    for (std::size_t at = page.find(attribute); at != page.npos; at = page.find(attribute, at + 1)) {
      const std::string_view rest = std::string_view(page).substr(at + attribute.size());
      EXPECT_TRUE(!rest.starts_with('=') || rest.starts_with("=\"#")) << rest.substr(0, 60);
    }
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
}

TEST(Page, InsertsTextAsTextOnly) {
  for (const char* part :
       {"innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "new Function"})
    EXPECT_THAT(std::string(page_template()), Not(HasSubstr(part)));
}

TEST(Page, EveryModuleOfThePageIsInlined) {
  const std::string script = script_in(page_template());
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(std::filesystem::path(TRUNDLE_SOURCE_DIR) / "web")) {
    if (entry.path().extension() != ".js" || entry.path().string().find("/vendor/") != std::string::npos)
      continue;
    const auto name =
        std::filesystem::relative(entry.path(), std::filesystem::path(TRUNDLE_SOURCE_DIR) / "web").string();
    if (name.starts_with("fleet/") || name == "strings/fleet.js") continue;  // of another page
    EXPECT_EQ(count(script, "\n// " + name + "\n"), 1) << name;
  }
  EXPECT_THAT(script, Not(HasSubstr("\nimport ")));
  EXPECT_THAT(script, Not(HasSubstr("\nexport ")));
}

TEST(Page, TheScriptIsValid) {
  if (std::system("node --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "node is not installed";
  const auto path =
      std::filesystem::temp_directory_path() / ("trundle_page_" + std::to_string(::getpid()) + ".mjs");
  write_file(path, script_in(page_template()));
  EXPECT_EQ(std::system(("node --check " + path.string()).c_str()), 0);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace trundle::report
