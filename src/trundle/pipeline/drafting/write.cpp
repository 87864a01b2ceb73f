#include <algorithm>

#include <fmt/format.h>

#include "trundle/pipeline/drafting/draft.hpp"

namespace trundle::pipeline {
namespace {

/// As TOML takes any text.
std::string quoted_toml(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      (quoted += '\\') += c;
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      quoted += fmt::format("\\u{:04X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      quoted += c;
  }
  return quoted + '"';
}

/// A key of TOML: names of wheels are of letters, digits and underscores alone.
std::string column_line(const DraftColumn& column, bool is_csv) {
  std::string value;
  const bool is_plain = column.topic.empty() && column.unit.empty() && column.scale == 1.0;
  if (is_plain) return fmt::format("columns.{} = {}\n", column.column, quoted_toml(column.field));
  const auto add = [&](std::string_view key, const std::string& text) {
    value += fmt::format("{}{} = {}", value.empty() ? "" : ", ", key, text);
  };
  if (!column.topic.empty()) add("topic", quoted_toml(column.topic));
  add(is_csv ? "column" : "field", quoted_toml(column.field));
  if (!column.unit.empty()) add("unit", quoted_toml(column.unit));
  if (column.scale == -1.0)
    add("sign", "-1");
  else if (column.scale != 1.0)
    add("scale", fmt::format("{}", column.scale));
  return fmt::format("columns.{} = {{ {} }}\n", column.column, value);
}

std::string table_of(const DraftStream& stream) {
  const bool is_csv =
      stream.topic.empty() &&
      std::ranges::all_of(stream.columns, [](const DraftColumn& column) { return column.topic.empty(); });
  std::string text = fmt::format("[{}]\nfile = {}\n", stream.table, quoted_toml(stream.file));
  if (!stream.topic.empty()) text += fmt::format("topic = {}\n", quoted_toml(stream.topic));
  if (!stream.body_frame.empty()) text += fmt::format("body_frame = {}\n", quoted_toml(stream.body_frame));
  text += stream.format;
  if (!stream.time_unit.empty()) text += fmt::format("time_unit = {}\n", quoted_toml(stream.time_unit));
  if (stream.rebuilt_separation_m)
    text += fmt::format("rebuild = {{ wheel_separation_m = {} }}\n", *stream.rebuilt_separation_m);
  if (is_csv && std::ranges::count(stream.columns, "time_s", &DraftColumn::column) == 0)
    text += "# columns.time_s =    # TO FILL IN: the column of stamps, or rate_hz\n";
  for (const DraftColumn& column : stream.columns) text += column_line(column, is_csv);
  return text;
}

std::string as_comment(const std::string& text) {
  std::string commented;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    commented += "# " + text.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  return commented;
}

/// The value, or a line that asks for it.
std::string number_line(std::string_view key, const std::optional<double>& value, std::string_view what) {
  return value ? fmt::format("{} = {:.6g}\n", key, *value)
               : fmt::format("# {} =    # TO FILL IN: {}\n", key, what);
}

/// A fixed wheel goes without saying.
std::string_view kind_lines(chassis::WheelKind kind) {
  switch (kind) {
    case chassis::WheelKind::skid:
      return "kind = \"skid\"\n";
    case chassis::WheelKind::omni:
      return "kind = \"omni\"\n";
    case chassis::WheelKind::mecanum:
      return "kind = \"mecanum\"\n# roller_deg =    # TO FILL IN: 45 or -45, by how the rollers stand\n";
    case chassis::WheelKind::fixed:
      break;
  }
  return "";
}

std::string wheel_table(const DraftWheel& wheel, std::size_t count) {
  std::string text = fmt::format("\n[[wheel]]\nname = {}\n", quoted_toml(wheel.name));
  if (wheel.x_m || count > 2)
    text += number_line("x_m", wheel.x_m, "how far ahead of the middle the wheel stands [m]");
  text += number_line("y_m", wheel.y_m, "how far left of the middle; right: negative [m]");
  text += kind_lines(wheel.kind);
  if (wheel.is_steered) text += "steered = true\n";
  text += number_line("diameter_m", wheel.diameter_m, "[m]");
  if (wheel.recorded_diameter_m) text += number_line("recorded_diameter_m", wheel.recorded_diameter_m, "");
  if (wheel.needs_ticks)
    text += number_line("ticks_per_revolution", std::nullopt, "counts of a turn; negative: backwards");
  return text;
}

}  // namespace

namespace {

std::string gyro_table(const std::optional<DraftGyro>& gyro) {
  if (!gyro) return "\n[gyro]\n";
  return fmt::format(
      "\n[gyro]\n# From {:.0f} s in which no wheel turns: the mean, and the noise ± {:.1g}.\n"
      "bias_rad_s = {:.4g}\nnoise_rad_s_sqrt_hz = {:.3g}\n",
      gyro->rest_s, gyro->noise_sigma, gyro->bias_rad_s, gyro->noise_rad_s_sqrt_hz);
}

std::string landmark_sensor_table(const std::optional<DraftMount>& mount) {
  std::string text = "\n[landmark_sensor]\n";
  if (!mount)
    return text + "# x_m, y_m, heading_deg =    # TO FILL IN: where the sensor stands and where it looks\n";
  for (const auto& [key, value] : {std::pair("x_m", mount->x_m), std::pair("y_m", mount->y_m),
                                   std::pair("heading_deg", mount->heading_deg)})
    text += number_line(key, value, "");
  return text;
}

}  // namespace

std::string robot_toml(const Draft& draft) {
  std::string text = "# Drafted by trundle init. docs/robot.md explains every key.\n";
  for (const std::string& source : draft.sources) text += as_comment(source);
  text += fmt::format("name = {}\n", quoted_toml(draft.robot_name));
  for (const DraftWheel& wheel : draft.wheels) text += wheel_table(wheel, draft.wheels.size());
  if (draft.has_gyro) text += gyro_table(draft.gyro);
  if (draft.has_landmark_sensor) text += landmark_sensor_table(draft.landmark_sensor);
  return text;
}

std::string recording_toml(const Draft& draft) {
  std::string text = "# Drafted by trundle init. docs/recording.md explains every key.\n";
  for (const std::string& note : draft.notes) text += as_comment(note);
  for (const DraftStream& stream : draft.streams) {
    text += "\n";
    if (!stream.reason.empty()) text += as_comment(stream.reason);
    text += table_of(stream);
  }
  if (!draft.alternatives.empty()) text += "\n# What might be meant as well:\n";
  for (const DraftStream& stream : draft.alternatives)
    text += as_comment((stream.reason.empty() ? "" : "\n" + stream.reason + ":\n") + table_of(stream));
  return text;
}

}  // namespace trundle::pipeline
