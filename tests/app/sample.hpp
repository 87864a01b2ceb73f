#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace trundle::test {

/// A fresh folder with inputs for every command: nominal.toml; the runs `cw` and `ccw`, squares of 1 m of a
/// robot that differs from nominal.toml, with wheels.csv and reference.csv; `blind`, the same wheels without
/// a reference; `seen`, the same wheels with sightings, for the robot sighted.toml, and map.csv with the
/// landmarks that it sees; `seen_half`, its beginning; other_map.csv and twice.csv, maps of others and of one
/// twice; `unnamed`, with a sighting without a name; scenario.toml; slippery.toml, a scenario in which a
/// wheel of with_gyro.toml slips; pods.toml and `l_run`, an L-shaped run of two dead wheels; later.csv, a
/// reference of another time; the folder `empty`; sheet.csv, measured on a 2 m square. Removed at the end.
class Sample {
 public:
  Sample();
  ~Sample();
  Sample(const Sample&) = delete;
  Sample& operator=(const Sample&) = delete;

  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

/// What files below a folder hold, by their paths from there. Of a folder that is not there: nothing.
std::map<std::string, std::string> files_below(const std::filesystem::path& folder);

}  // namespace trundle::test
