#include "trundle/pipeline/innovations.hpp"

#include <fmt/format.h>

#include "trundle/recording/landmark_file.hpp"
#include "trundle/report/slam_result.hpp"

namespace trundle::pipeline {
std::string landmark_in(const Observation& observation, const ObservationReport& report,
                        const std::vector<std::string>& names) {
  const LandmarkId id = observation.landmark >= 0 ? observation.landmark : report.landmark;
  return id < 0 ? "" : names[static_cast<std::size_t>(id)];
}

void append_innovations(std::string& text, const SlamStep& step,
                        const std::vector<ObservationReport>& reports,
                        const std::vector<std::string>& names) {
  for (std::size_t i = 0; i < step.observations.size(); ++i) {
    const ObservationReport& report = reports[i];
    text += fmt::format("{},{},{},", step.time_s, text_cell(landmark_in(step.observations[i], report, names)),
                        report::name_of(report.decision));
    text += report.nis > 0.0
                ? fmt::format("{},{},{}\n", report.innovation.x(), report.innovation.y(), report.nis)
                : std::string(",,\n");
  }
}

}  // namespace trundle::pipeline
