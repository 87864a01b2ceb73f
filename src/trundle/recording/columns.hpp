#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trundle/recording/recording.hpp"

namespace trundle::recording {

/// A stream whose rows are in memory already, not in a file.
struct StreamColumns {
  std::string stream;  ///< that of its native file, without ".csv": "wheels", "gyro", "reference", ...
  /// By the names of the columns of that file, `time_s` among them. What is no finite number was not
  /// measured.
  std::vector<std::pair<std::string, std::vector<double>>> numbers;
  std::vector<std::string> landmarks = {};  ///< the column `landmark` of sightings and landmarks
  std::vector<std::string> left_out = {};   ///< names of columns that it does not take: one may be mistyped
};

/// The recording that a folder with these columns as native files would give, findings included; rows are
/// named as "wheels:12", counted from 1. Throws InputError as read_recording does: for an unknown stream, a
/// column that is missing, unknown or of another length.
[[nodiscard]] Recording recording_of(const std::string& name, std::vector<StreamColumns> streams);

/// Whether a stream takes a column of this name. Throws InputError for an unknown stream.
[[nodiscard]] bool has_column(std::string_view stream, std::string_view column);

/// The columns of wheels.csv besides the stamps, under their names there.
[[nodiscard]] std::vector<std::pair<std::string, const std::vector<double>*>> columns_of(
    const WheelStream& wheels);

}  // namespace trundle::recording
