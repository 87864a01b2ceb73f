#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/calibration/install_angle/install_angle.hpp"
#include "trundle/report/provenance.hpp"

namespace trundle::pipeline {

/// What `trundle install-angle` found.
struct InstallAngleAnswer {
  Provenance provenance;
  std::vector<LRun> runs;
  InstallAngle angle;
};

/// The runs that recordings hold, and what they were read from. Throws as l_run_of.
struct LinesDriven {
  std::vector<LRun> runs;
  std::vector<InputFile> files;
};
LinesDriven lines_driven(const std::vector<std::string>& recordings, const std::string& robot);

/// What `trundle install-angle --json` prints.
nlohmann::ordered_json document_of(const InstallAngleAnswer& answer);

}  // namespace trundle::pipeline
