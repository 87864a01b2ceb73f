// landmarks.csv, and landmarks_covariance.csv beside it.
#include "trundle/recording/landmark_file.hpp"

#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trundle;
  static const fuzz::Folder folder;
  folder.clear();
  folder.write_all(fuzz::text_of(data, size));
  return fuzz::try_to([&] {
    const auto file = folder.path() / "landmarks.csv";
    const std::vector<recording::MapLandmark> map = recording::read_landmark_map(file);
    (void)recording::read_landmark_covariance(recording::covariance_file_of(file), map);
  });
}
