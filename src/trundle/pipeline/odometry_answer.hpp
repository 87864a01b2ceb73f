#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/odometry/effective_track.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/report/odometry_result.hpp"

namespace trundle::pipeline {

/// What `trundle odometry` is asked, besides recording and robot.
struct OdometryQuestion {
  Pose2 start = {};                  ///< pose at the first stamp
  std::string start_text = "0,0,0";  ///< the same as it was given
  bool smooth = false;               ///< every pose also by what later rests show of the gyro's bias
  ReadOptions reading = {};          ///< how its recordings are read
};

struct OdometryAnswer {
  Provenance provenance;
  IntegratedOdometry odometry;        ///< with the findings of reading the recording
  std::vector<TrackOnGround> tracks;  ///< where wheels must scrub in turns
};

/// What its files say of where they come from.
Provenance provenance_of_odometry(const Recording& recording, const RobotFile& robot,
                                  const OdometryQuestion& question);

/// `take`, where there is one, has the poses as they come, and the answer keeps none of them. Throws as
/// integrate.
OdometryAnswer answer_odometry(const Recording& recording, const RobotFile& robot,
                               const OdometryQuestion& question, const TakePose& take = {});

/// What the page draws of it.
OdometryResult odometry_result_of(const OdometryAnswer& answer);

/// What `trundle odometry --json` prints.
nlohmann::ordered_json document_of(const OdometryAnswer& answer);

}  // namespace trundle::pipeline
