#include "trundle/calibration/squares/sheet.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

namespace trundle::calibration {
namespace {

enum Column { kTurn, kX, kY, kHeading, kLeg, kLeftRevolutions, kRightRevolutions, kColumnCount };

const std::array<std::string, kColumnCount> kColumnNames = {
    "turn", "x_m", "y_m", "heading_deg", "leg_m", "left_revolutions", "right_revolutions"};
constexpr std::string_view kHeaderForm =
    "turn,x_m,y_m,heading_deg[,leg_m][,left_revolutions,right_revolutions]";

/// A heading error is written as it is; more than this is not one square any more.
constexpr double kLargestHeadingDeg = 540.0;
/// An end further away than this many sides was not reached on the square: most likely another unit.
constexpr double kLargestErrorInSides = 8.0;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  for (;;) {
    const std::size_t comma = line.find(',');
    fields.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

/// A finite number that fills the whole text.
std::optional<double> number_in(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

class SheetParser {
 public:
  SheetParser(std::string_view file_name, std::optional<double> side_m)
      : file_(file_name), side_option_(side_m) {
    if (side_m && !(std::isfinite(*side_m) && *side_m > 0.0))
      throw InputError("--side-m", fmt::format("the side is {}", *side_m), "a length above 0 m");
  }

  void read(std::string_view line) {
    ++line_;
    line = trimmed(line);
    if (line.starts_with('#')) {
      read_comment(line.substr(1));
    } else if (!line.empty()) {
      fields_ = fields_of(line);
      header_line_ == 0 ? read_header() : read_row();
    }
  }

  SquareSheet finish() && {
    if (header_line_ == 0) fail(file_, "holds no header", std::string(kHeaderForm));
    if (sheet_.runs.empty()) fail(file_, "holds no runs", "one row for each run, cw and ccw");
    settle_side();
    for (const SquareRun& run : sheet_.runs) check_against_side(run);
    sheet_.name = file_;
    return std::move(sheet_);
  }

 private:
  [[noreturn]] static void fail(const std::string& where, const std::string& fact,
                                const std::string& expectation) {
    throw InputError(where, fact, expectation);
  }
  std::string here() const { return place(file_, line_); }

  void read_comment(std::string_view text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string_view::npos || trimmed(text.substr(0, equals)) != "side_m") return;
    const std::string_view value = trimmed(text.substr(equals + 1));
    const auto side = number_in(value);
    if (!side || *side <= 0.0) fail(here(), fmt::format("side_m is '{}'", value), "a length above 0 m");
    if (side_comment_ && *side_comment_ != *side)
      fail(here(), fmt::format("side_m is {} here and {} in line {}", *side, *side_comment_, side_line_),
           "one side_m");
    side_comment_ = side;
    side_line_ = line_;
  }

  void read_header() {
    header_line_ = line_;
    header_ = fields_;
    column_.fill(-1);
    for (const std::string_view name : fields_)
      if (name.find_first_of(";\t") != std::string_view::npos)
        fail(here(), "the header separates its columns otherwise", "commas: " + std::string(kHeaderForm));
    for (std::size_t i = 0; i < fields_.size(); ++i) place_column(i);
    for (std::size_t i = 0; i < fields_.size(); ++i) refuse_misspelt(fields_[i]);
    for (const Column needed : {kTurn, kX, kY, kHeading})
      if (column_[needed] < 0)
        fail(here(), fmt::format("the header has no column {}", kColumnNames[needed]),
             std::string(kHeaderForm));
    if ((column_[kLeftRevolutions] < 0) != (column_[kRightRevolutions] < 0))
      fail(here(), "the header has only one column of revolutions", "left_revolutions and right_revolutions");
  }

  void place_column(std::size_t index) {
    const auto known = std::ranges::find(kColumnNames, fields_[index]);
    if (known == kColumnNames.end()) return;
    int& column = column_[static_cast<std::size_t>(known - kColumnNames.begin())];
    if (column >= 0) fail(here(), fmt::format("the header has two columns {}", *known), "each column once");
    column = static_cast<int>(index);
  }

  /// Other columns are ignored, unless one is nearly the name of a column that is missing.
  void refuse_misspelt(std::string_view name) const {
    if (std::ranges::find(kColumnNames, name) != kColumnNames.end()) return;
    std::vector<std::string> missing;
    for (std::size_t i = 0; i < kColumnNames.size(); ++i)
      if (column_[i] < 0) missing.push_back(kColumnNames[i]);
    const std::string meant = nearest_name(name, missing);
    if (!meant.empty()) fail(here(), fmt::format("unknown column '{}'", name), meant);
  }

  void read_row() {
    if (std::ranges::equal(fields_, header_))
      fail(here(), fmt::format("the header of line {} again", header_line_),
           "a run: cw or ccw and its numbers");
    if (fields_.size() != header_.size())
      fail(here(), fmt::format("{} fields", fields_.size()),
           fmt::format("{} as in the header", header_.size()));
    SquareRun run;
    run.name = here();
    run.turn = turn();
    run.error = {number(kX), number(kY), radians(heading_deg())};
    run.leg_m = positive(kLeg);
    run.left_revolutions = positive(kLeftRevolutions);
    run.right_revolutions = positive(kRightRevolutions);
    if (run.left_revolutions.has_value() != run.right_revolutions.has_value())
      fail(here(), "revolutions of one wheel only", "both or none");
    sheet_.runs.push_back(std::move(run));
  }

  std::string_view field(Column column) const { return fields_[static_cast<std::size_t>(column_[column])]; }

  Turn turn() const {
    if (field(kTurn) == "cw") return Turn::cw;
    if (field(kTurn) == "ccw") return Turn::ccw;
    fail(here(), fmt::format("turn is '{}'", field(kTurn)), "cw or ccw");
  }

  double number(Column column) const {
    const auto value = number_in(field(column));
    if (!value)
      fail(here(), fmt::format("{} is '{}'", kColumnNames[column], field(column)), "a finite number");
    return *value;
  }

  double heading_deg() const {
    const double heading = number(kHeading);
    if (std::abs(heading) > kLargestHeadingDeg)
      fail(here(), fmt::format("heading_deg is {}", heading), "at most ±540 degrees");
    return heading;
  }

  std::optional<double> positive(Column column) const {
    if (column_[column] < 0 || field(column).empty()) return std::nullopt;
    const double value = number(column);
    if (value <= 0.0) fail(here(), fmt::format("{} is {}", kColumnNames[column], value), "a number above 0");
    return value;
  }

  void settle_side() {
    if (side_option_ && side_comment_ && *side_option_ != *side_comment_)
      fail(place(file_, side_line_),
           fmt::format("side_m is {} but --side-m {}", *side_comment_, *side_option_),
           "the same side in both");
    if (!side_option_ && !side_comment_)
      fail(file_, "the side of the square is not given", "a comment '# side_m = 2' or --side-m 2");
    sheet_.side_m = side_option_ ? *side_option_ : *side_comment_;
  }

  void check_against_side(const SquareRun& run) const {
    const double side = sheet_.side_m;
    if (std::hypot(run.error.x, run.error.y) > kLargestErrorInSides * side)
      fail(run.name,
           fmt::format("the end is {:g} m from the start, the side {:g} m",
                       std::hypot(run.error.x, run.error.y), side),
           "an end error in metres");
    if (run.leg_m && (*run.leg_m > 2.0 * side || *run.leg_m < 0.5 * side))
      fail(run.name, fmt::format("leg_m is {:g}, the side {:g} m", *run.leg_m, side),
           "a leg near the side, in metres");
  }

  std::string file_;
  std::optional<double> side_option_;
  std::optional<double> side_comment_;
  std::size_t side_line_ = 0;
  std::size_t line_ = 0;
  std::size_t header_line_ = 0;
  std::vector<std::string_view> header_;
  std::vector<std::string_view> fields_;
  std::array<int, kColumnCount> column_{};
  SquareSheet sheet_;
};

}  // namespace

std::string_view name_of(Turn turn) {
  return turn == Turn::cw ? "cw" : "ccw";
}

SquareSheet parse_sheet(std::string_view text, std::string_view file_name, std::optional<double> side_m) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  SheetParser parser(file_name, side_m);
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    parser.read(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return std::move(parser).finish();
}

SquareSheet read_sheet(const std::filesystem::path& path, std::optional<double> side_m) {
  return parse_sheet(read_file(path), path.string(), side_m);
}

}  // namespace trundle::calibration
