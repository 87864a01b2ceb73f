#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "trundle/report/compared_with.hpp"
#include "trundle/report/provenance.hpp"
#include "trundle/report/results.hpp"

namespace trundle::pipeline {

struct ReportQuestion {
  std::vector<std::string> inputs;  ///< folders of results, or their files
  std::string reference = {};       ///< what folders without one are compared with: a recording, a trajectory
  std::string robot = {};  ///< file of the robot whose reference sensor it is; else what run.json says
};

/// What `trundle report` draws: docs/report-json.md.
struct ReportAnswer {
  Provenance provenance;
  nlohmann::ordered_json document;
};

/// Of results as they are there.
ReportAnswer report_of(std::vector<Results> results, const ComparedWith& with = {},
                       Provenance provenance = {});
/// Reads them. Throws InputError.
ReportAnswer answer_report(const ReportQuestion& question);

}  // namespace trundle::pipeline
