#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "trundle/report/compared_with.hpp"
#include "trundle/report/picture_rows.hpp"
#include "trundle/report/results.hpp"

namespace trundle::report {

/// What stands under "format" and "format_version" of the report's document.
inline constexpr std::string_view kReportFormat = "trundle-report";
inline constexpr int kReportFormatVersion = 1;

/// One result of the document that docs/report-json.md describes, computed for drawing. `with`: what
/// trajectories are compared with; where the result has a reference of its own, that one, and where `with`
/// has no robot the one that was used. `rows`: as many as a picture keeps, rows_in_picture().
nlohmann::ordered_json result_json(Results results, ComparedWith with = {},
                                   std::size_t rows = kRowsInPicture);

/// The same of a folder of results, or of one file of them. Throws as read_results.
nlohmann::ordered_json read_result(const std::filesystem::path& input, const ComparedWith& with = {});

/// A result that is a calibration alone.
nlohmann::ordered_json result_of_calibration(const nlohmann::ordered_json& calibration);

/// The document of results: their clocks start together where their recordings overlap.
nlohmann::ordered_json report_json(std::span<const nlohmann::ordered_json> results,
                                   const nlohmann::ordered_json& provenance);

}  // namespace trundle::report
