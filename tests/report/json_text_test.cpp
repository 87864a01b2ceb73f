#include "trundle/report/json_text.hpp"

#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace trundle::report {
namespace {

using Json = nlohmann::ordered_json;

TEST(JsonText, PutsArraysOfPlainValuesOnOneLine) {
  const Json document = {
      {"a", 1}, {"b", {1.5, nullptr, "x"}}, {"c", Json::array({Json::array({1, 2}), Json::array({3, 4})})}};
  EXPECT_EQ(json_text(document),
            "{\n  \"a\": 1,\n  \"b\": [1.5,null,\"x\"],\n  \"c\": [\n    [1,2],\n    [3,4]\n  ]\n}\n");
}

TEST(JsonText, EmptyOnesStayShort) {
  EXPECT_EQ(json_text(Json::object()), "{}\n");
  EXPECT_EQ(json_text({{"a", Json::array()}, {"b", Json::object()}}), "{\n  \"a\": [],\n  \"b\": {}\n}\n");
  EXPECT_EQ(json_text(3), "3\n");
}

TEST(JsonText, ParsesBackToTheSame) {
  const Json document = {{"\"key\"\n", {{"x", {{{"y", "</script>\t🤖"}}, {0.1, -1e-300}}}}}, {"", false}};
  EXPECT_EQ(Json::parse(json_text(document)), document);
}

TEST(JsonText, ControlCharactersAreEscaped) {
  std::string controls = "a";
  for (char c = 0; c < 0x20; ++c) controls += c;
  const Json document = {{controls + "\x7fz", "\x7f\u00fc"}};
  const std::string text = dumped(document);
  EXPECT_TRUE(std::ranges::none_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; })) << text;
  EXPECT_EQ(Json::parse(text), document);
}

}  // namespace
}  // namespace trundle::report
