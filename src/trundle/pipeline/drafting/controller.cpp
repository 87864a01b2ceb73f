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

/// Scalars by their keys: as much of YAML as parameters of controllers are written in. Of a list, the key.
using YamlScalars = std::map<std::string, std::string, std::less<>>;

YamlScalars yaml_scalars(std::string_view text) {
  YamlScalars values;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line = line.substr(0, line.find(" #"));
    const std::string_view content = line.substr(std::min(line.find_first_not_of(" \t\r"), line.size()));
    const std::size_t colon = content.find(':');
    if (content.starts_with('#') || content.starts_with("- ") || colon == std::string_view::npos) continue;
    values.insert_or_assign(std::string(stripped(content.substr(0, colon))),
                            std::string(stripped(content.substr(colon + 1))));
  }
  return values;
}

class Parameters {
 public:
  Parameters(YamlScalars values, std::string file) : values_(std::move(values)), file_(std::move(file)) {}

  std::optional<double> number(std::string_view key) const {
    const auto found = values_.find(key);
    if (found == values_.end() || found->second.empty()) return std::nullopt;
    const std::string& text = found->second;
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value > 0.0) || value > 1e3)
      throw InputError(file_, fmt::format("{} is '{}'", key, text), "a number above 0");
    return value;
  }
  bool has(std::string_view key) const { return values_.contains(key); }

 private:
  YamlScalars values_;
  std::string file_;
};

}  // namespace

RobotGeometry read_controller(const std::filesystem::path& path) {
  const Parameters parameters(yaml_scalars(read_file(path)), path.string());
  RobotGeometry geometry;
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
