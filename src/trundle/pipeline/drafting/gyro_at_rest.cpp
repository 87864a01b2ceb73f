#include <algorithm>
#include <array>
#include <string_view>

#include "trundle/io/error.hpp"
#include "trundle/odometry/gyro_noise.hpp"
#include "trundle/pipeline/drafting/draft.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::pipeline {
namespace {

// Of the noise, as a share of it: 50 degrees of freedom and more, a second of a gyro of 100 Hz.
constexpr double kKnownWithin = 0.1;

/// What says how the gyro turned and when the robot stood, with files as they are found from anywhere: the
/// folder of the draft may not be there yet.
Draft of_turns_and_rests(const Draft& draft, const std::filesystem::path& folder) {
  constexpr std::array<std::string_view, 3> kTables = {"wheels", "velocity", "gyro"};
  Draft part;
  for (const DraftStream& stream : draft.streams)
    if (std::ranges::find(kTables, stream.table) != kTables.end()) part.streams.push_back(stream);
  for (DraftStream& stream : part.streams)
    stream.file = std::filesystem::weakly_canonical(std::filesystem::absolute(folder) / stream.file).string();
  return part;
}

bool is_of_angles(const DraftStream& stream) {
  return std::ranges::find(stream.columns, "yaw_rad", &DraftColumn::column) != stream.columns.end();
}

}  // namespace

std::optional<DraftGyro> gyro_at_rest(const Draft& draft, const std::filesystem::path& file,
                                      const std::vector<std::filesystem::path>& message_folders) {
  const auto gyro = std::ranges::find(draft.streams, "gyro", &DraftStream::table);
  if (gyro == draft.streams.end() || is_of_angles(*gyro)) return std::nullopt;
  std::optional<GyroNoise> noise;
  try {
    const std::string map = recording_toml(of_turns_and_rests(draft, file.parent_path()));
    noise = gyro_noise(read_mapped_by(map, file, message_folders), Chassis{});
  } catch (const InputError&) {
    return std::nullopt;  // a draft that does not read yet is for a person to fill in
  }
  if (!noise || noise->noise_rad_s_sqrt_hz <= noise->rounding_rad_s_sqrt_hz ||
      noise->noise_sigma > kKnownWithin * noise->noise_rad_s_sqrt_hz)
    return std::nullopt;
  return DraftGyro{noise->bias_rad_s, noise->noise_rad_s_sqrt_hz, noise->noise_sigma, noise->rest_s};
}

}  // namespace trundle::pipeline
