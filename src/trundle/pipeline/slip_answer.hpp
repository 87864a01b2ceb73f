#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/report/slip_result.hpp"
#include "trundle/slip/find_slip.hpp"

namespace trundle::pipeline {

/// What `trundle slip` is asked, besides recording and robot.
struct SlipQuestion {
  std::vector<std::string> learn = {};  ///< folders of recordings without slip
  double probability = 0.01;            ///< that an interval without slip is flagged
  double interval_s = 0.25;             ///< readings are judged over at least this long
  double spin_odds =
      SlipOptions{}.spin_odds;  ///< that a wheel which slips while it pushes spins, to its skidding
  SlipMethod method = SlipMethod::general;
  ReadOptions reading = {};           ///< how its recordings are read
  std::vector<Recording> clean = {};  ///< more without slip, which are read already
};

/// What clean recordings taught.
struct LearnedSlip {
  std::vector<double> sample;  ///< the residuals
  NormalityTest normality;
  bool empirical = false;      ///< not normal: the limit is a quantile of the sample
  bool beyond_sample = false;  ///< and it is its largest one, for lack of more
};

struct SlipAnswer {
  Provenance provenance;
  SlipOptions options;  ///< with the model or the band that was learned
  std::optional<LearnedSlip> learned;
  SlipReport report;  ///< with the findings of reading the recording
  std::string recording;
};

/// Throws as find_slip, and as learn_residuals or learn_band.
SlipAnswer answer_slip(const Recording& recording, const RobotFile& robot, const SlipQuestion& question);

/// The odometry of the recording's corrected readings. `take`, where there is one, has the poses as they
/// come. Throws as integrate, and CannotAnswer where a pose is no number.
IntegratedOdometry corrected_odometry(const Recording& recording, const SlipAnswer& answer,
                                      const Robot& robot, const TakePose& take = {});

/// The recording's readings for those who go on from them: corrected for slip where that is asked, by the
/// answer `found` to that question where there is one already. What was learned from is added to the
/// provenance's inputs.
AlignedReadings corrected_readings(const Recording& recording, const RobotFile& robot,
                                   const std::optional<SlipQuestion>& slip, const SlipAnswer* found,
                                   Provenance& provenance);
/// The options of such a correction.
void add_options_of(const std::optional<SlipQuestion>& slip, Provenance& provenance);

/// What slip.json and the page say of it.
SlipResult slip_result_of(const SlipAnswer& answer, const Robot& robot);

/// What `trundle slip --json` prints.
nlohmann::ordered_json document_of(const SlipAnswer& answer, const Robot& robot);

/// slip.csv.
std::string slip_csv_of(const SlipAnswer& answer, const Robot& robot);

/// "general" or "published".
std::string name_of(SlipMethod method);

}  // namespace trundle::pipeline
