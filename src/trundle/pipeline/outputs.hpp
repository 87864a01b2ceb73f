#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/io/staging.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/pipeline/files.hpp"
#include "trundle/report/provenance.hpp"

namespace trundle::pipeline {

/// As CSV, or as TUM where the name says so, with the provenance in its head. The trajectory must outlive it.
OutputFile trajectory_file(const std::filesystem::path& path, const Provenance& provenance,
                           const Trajectory& trajectory);
/// The same of poses that `produce` hands on while the file is written.
OutputFile trajectory_file(const std::filesystem::path& path, const Provenance& provenance,
                           std::function<void(const TakePose&)> produce);

/// Writes a set of results and puts it into its folder in place of an earlier one, of which `earlier` names
/// all files that there may be. `index` is the file that says the set is whole. Throws InputError, and writes
/// nothing, where a result would go over one of the inputs.
void write_set(ResultFolder& results, const std::filesystem::path& folder,
               const std::vector<OutputFile>& files, const std::vector<InputFile>& inputs,
               const std::vector<std::string>& earlier, const std::string& index);

}  // namespace trundle::pipeline
