#include "trundle/pipeline/outputs.hpp"

#include <set>

#include "trundle/recording/trajectory_file.hpp"

namespace trundle::pipeline {

OutputFile trajectory_file(const std::filesystem::path& path, const Provenance& provenance,
                           const Trajectory& trajectory) {
  return {path, head_of(provenance),
          [&trajectory, is_tum = path.extension() == ".tum"](const TakeText& take) {
            is_tum ? write_tum(trajectory, take) : write_csv(trajectory, take);
          }};
}

OutputFile trajectory_file(const std::filesystem::path& path, const Provenance& provenance,
                           std::function<void(const TakePose&)> produce) {
  const TrajectoryFormat format = path.extension() == ".tum" ? TrajectoryFormat::tum : TrajectoryFormat::csv;
  return {
      path, head_of(provenance), [format, produce = std::move(produce)](const TakeText& take) {
        TrajectoryWriter writer(format, true, take);
        produce([&](const StampedPose& pose, const Matrix3& covariance) { writer.add(pose, covariance); });
        writer.finish();
      }};
}

void write_set(ResultFolder& results, const std::filesystem::path& folder,
               const std::vector<OutputFile>& files, const std::vector<InputFile>& inputs,
               const std::vector<std::string>& earlier, const std::string& index) {
  std::set<std::string> names(earlier.begin(), earlier.end());
  for (const OutputFile& file : files) names.insert(file.path.lexically_relative(folder).generic_string());
  std::vector<std::filesystem::path> places;
  for (const std::string& name : names) places.push_back(folder / name);
  require_apart(inputs, places);
  for (const OutputFile& file : files) results.write(file.path, file.content, file.rest);
  results.commit(names, index);
}

}  // namespace trundle::pipeline
