#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "trundle/namespaces.hpp"

namespace trundle::report {

/// A slip, its wheel and kind by their names.
struct SlipRow {
  double start_s = 0.0;
  double end_s = 0.0;
  std::string wheel;
  std::string kind;
  double excess_m = 0.0;
  double confidence = 0.0;
  std::optional<double> excess_sigma_m = {};  ///< nothing: the file has none
  /// Share of those as clear as this one that noise alone makes; nothing: the file has none.
  std::optional<double> by_chance = {};
};

/// The statistic of every interval in columns, and what it is judged by.
struct SlipTimeline {
  std::string statistic;             ///< "chi2" or "delta_rad"
  std::optional<double> limit = {};  ///< of chi2
  std::optional<double> lower = {};  ///< of delta_rad
  std::optional<double> upper = {};
  std::vector<double> end_s = {};
  std::vector<double> value = {};  ///< NaN: not judged
  std::vector<std::string> status = {};
  std::vector<bool> slipping = {};
};

/// What slip.json says besides its provenance and problems; of slip.csv the events alone.
struct SlipResult {
  nlohmann::ordered_json counts = {};  ///< of intervals by what became of them; null: not known
  std::vector<SlipRow> events = {};
  std::optional<SlipTimeline> timeline = {};
  nlohmann::ordered_json learned = {};  ///< from clean recordings; null: nothing was
  std::vector<std::string> cannot_see = {};
};

nlohmann::ordered_json to_json(const SlipRow& event);
nlohmann::ordered_json to_json(const SlipResult& slip);
/// Each throws InputError with file, what stands there and what was expected.
SlipResult slip_from_json(std::string_view text, std::string_view file_name);
SlipResult slip_from_csv(const std::filesystem::path& csv);

}  // namespace trundle::report
