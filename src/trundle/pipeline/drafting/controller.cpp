#include <charconv>
#include <map>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/pipeline/drafting/draft.hpp"

namespace trundle::pipeline {
namespace {

std::string_view stripped(std::string_view text) {
  constexpr std::string_view kOuter = " \t\r\n\"'";
  const std::size_t begin = text.find_first_not_of(kOuter);
  return begin == std::string_view::npos ? std::string_view{}
                                         : text.substr(begin, text.find_last_not_of(kOuter) - begin + 1);
}

/// A scalar or a list of scalars, by its key: as much of YAML as parameters of controllers are written in.
using YamlValues = std::map<std::string, std::vector<std::string>, std::less<>>;

void add_scalars(std::string_view text, std::vector<std::string>& values) {
  while (!text.empty()) {
    const std::size_t comma = std::min(text.find(','), text.size());
    if (const std::string_view value = stripped(text.substr(0, comma)); !value.empty())
      values.emplace_back(value);
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
}

YamlValues yaml_values(std::string_view text) {
  YamlValues values;
  std::vector<std::string>* open = nullptr;  // a list that goes on
  bool is_flow = false;                      // [a, b over several lines
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line = line.substr(0, line.find(" #"));
    std::string_view content = line.substr(std::min(line.find_first_not_of(" \t\r"), line.size()));
    if (content.empty() || content.starts_with('#')) continue;
    if (is_flow || (content.starts_with("- ") && open != nullptr)) {
      const std::size_t close = content.find(']');
      add_scalars(is_flow ? content.substr(0, close) : content.substr(2), *open);
      is_flow = is_flow && close == std::string_view::npos;
      continue;
    }
    const std::size_t colon = content.find(':');
    if (colon == std::string_view::npos) continue;
    open = &values[std::string(stripped(content.substr(0, colon)))];
    open->clear();
    std::string_view value = stripped(content.substr(colon + 1));
    if (value.starts_with('[')) {
      const std::size_t close = value.find(']');
      is_flow = close == std::string_view::npos;
      value = value.substr(1, is_flow ? close : close - 1);
    }
    add_scalars(value, *open);
  }
  return values;
}

class Parameters {
 public:
  Parameters(YamlValues values, std::string file) : values_(std::move(values)), file_(std::move(file)) {}

  std::optional<double> number(std::string_view key) const {
    const auto found = values_.find(key);
    if (found == values_.end() || found->second.empty()) return std::nullopt;
    const std::string& text = found->second.front();
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value > 0.0) || value > 1e3)
      throw InputError(file_, fmt::format("{} is '{}'", key, text), "a number above 0");
    return value;
  }
  std::vector<std::string> texts(std::initializer_list<std::string_view> keys) const {
    for (const std::string_view key : keys)
      if (const auto found = values_.find(key); found != values_.end() && !found->second.empty())
        return found->second;
    return {};
  }
  bool has(std::string_view key) const { return values_.contains(key); }

 private:
  YamlValues values_;
  std::string file_;
};

}  // namespace

RobotGeometry read_controller(const std::filesystem::path& path) {
  const Parameters parameters(yaml_values(read_file(path)), path.string());
  RobotGeometry geometry;
  geometry.left = parameters.texts({"left_wheel_names", "left_wheel"});
  geometry.right = parameters.texts({"right_wheel_names", "right_wheel"});
  geometry.is_mecanum = parameters.has("wheels_radius") || parameters.has("front_left_wheel_name");
  if (const auto separation_m = parameters.number("wheel_separation"))
    geometry.wheel_separation_m =
        *separation_m * parameters.number("wheel_separation_multiplier").value_or(1.0);
  std::optional<double> radius_m = parameters.number("wheel_radius");
  if (!radius_m) radius_m = parameters.number("wheels_radius");
  if (radius_m) {
    const double common = parameters.number("wheel_radius_multiplier").value_or(1.0);
    geometry.wheel_radius_m = *radius_m * parameters.number("left_wheel_radius_multiplier").value_or(common);
    geometry.right_wheel_radius_m =
        *radius_m * parameters.number("right_wheel_radius_multiplier").value_or(common);
  }
  if (!geometry.wheel_separation_m && !geometry.wheel_radius_m)
    throw InputError(path.string(), "has neither wheel_separation nor wheel_radius",
                     "the parameters of a diff_drive_controller or mecanum_drive_controller");
  return geometry;
}

}  // namespace trundle::pipeline
