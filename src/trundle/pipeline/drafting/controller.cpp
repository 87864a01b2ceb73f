#include <algorithm>
#include <charconv>
#include <optional>
#include <vector>

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

/// A scalar of YAML: the key that stands above it, and its own.
struct YamlScalar {
  std::string parent, key, value;
};

/// As much of YAML as parameters of controllers are written in: a key and its value a line, nested by
/// indentation. Of a list, the key.
std::vector<YamlScalar> yaml_scalars(std::string_view text) {
  struct Above {
    std::size_t indentation;
    std::string key;
  };
  std::vector<YamlScalar> values;
  std::vector<Above> above;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line = line.substr(0, line.find(" #"));
    const std::size_t indentation = std::min(line.find_first_not_of(" \t\r"), line.size());
    const std::string_view content = line.substr(indentation);
    const std::size_t colon = content.find(':');
    if (content.starts_with('#') || content.starts_with("- ") || colon == std::string_view::npos) continue;
    while (!above.empty() && above.back().indentation >= indentation) above.pop_back();
    values.push_back({above.empty() ? std::string() : above.back().key,
                      std::string(stripped(content.substr(0, colon))),
                      std::string(stripped(content.substr(colon + 1)))});
    above.push_back({indentation, values.back().key});
  }
  return values;
}

class Parameters {
 public:
  Parameters(std::vector<YamlScalar> values, std::string file)
      : values_(std::move(values)), file_(std::move(file)) {}

  /// `parent`: the key that must stand above; empty: any.
  std::optional<double> number(std::string_view key, std::string_view parent = {}) const {
    const YamlScalar* found = nullptr;
    for (const YamlScalar& scalar : values_) {
      if (scalar.key != key || scalar.value.empty() || (!parent.empty() && scalar.parent != parent)) continue;
      if (found != nullptr && found->value != scalar.value)
        throw InputError(file_,
                         fmt::format("{} is there twice, as {} and {}", key, found->value, scalar.value),
                         "the parameters of one controller");
      found = &scalar;
    }
    if (found == nullptr) return std::nullopt;
    const std::string& text = found->value;
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value > 0.0) || value > 1e3)
      throw InputError(file_, fmt::format("{} is '{}'", key, text), "a number above 0");
    return value;
  }
  bool has(std::string_view key) const {
    return std::ranges::find(values_, key, &YamlScalar::key) != values_.end();
  }

 private:
  std::vector<YamlScalar> values_;
  std::string file_;
};

/// The first of several names of one thing.
std::optional<double> first_of(std::initializer_list<std::optional<double>> values) {
  for (const std::optional<double>& value : values)
    if (value) return value;
  return std::nullopt;
}

}  // namespace

RobotGeometry read_controller(const std::filesystem::path& path) {
  const Parameters parameters(yaml_scalars(read_file(path)), path.string());
  RobotGeometry geometry;
  geometry.is_mecanum = parameters.has("wheels_radius") || parameters.has("front_left_wheel_name");
  geometry.separation_multiplier = parameters.number("wheel_separation_multiplier");
  // diff_drive_controller; turtlebot3_node
  if (const auto separation_m =
          first_of({parameters.number("wheel_separation"), parameters.number("separation", "wheels")}))
    geometry.wheel_separation_m = *separation_m * geometry.separation_multiplier.value_or(1.0);
  const std::optional<double> radius_m =
      first_of({parameters.number("wheel_radius"), parameters.number("wheels_radius"),
                parameters.number("radius", "wheels")});
  if (radius_m) {
    const double common = parameters.number("wheel_radius_multiplier").value_or(1.0);
    geometry.wheel_radius_m = *radius_m * parameters.number("left_wheel_radius_multiplier").value_or(common);
    geometry.right_wheel_radius_m =
        *radius_m * parameters.number("right_wheel_radius_multiplier").value_or(common);
  }
  if (!geometry.wheel_separation_m && !geometry.wheel_radius_m && !geometry.separation_multiplier)
    throw InputError(path.string(), "has neither wheel_separation nor wheel_radius",
                     "the parameters of a diff_drive_controller or mecanum_drive_controller");
  return geometry;
}

}  // namespace trundle::pipeline
