// Calibrates a robot from recordings with a reference (motion capture, surveyed poses, a tape measure):
// wheels and gyro with error bars, written as the robot file that the other examples take. In the root of the
// repository:
//   example_calibrate data/demo/robot.toml out/calibrated.toml data/demo/session_01 data/demo/session_03
#include "trundle/calibration/calibrate.hpp"

#include <cstdio>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/pipeline/files.hpp"

int main(int argc, char** argv) try {
  if (argc < 4)
    return std::fputs("usage: example_calibrate robot.toml calibrated.toml RECORDING...\n", stderr), 2;
  const trundle::Robot nominal = trundle::read_robot(argv[1]);
  // Of folders with several recordings, all; those below one folder are one session.
  const std::vector<trundle::Recording> recordings = trundle::read_recordings({argv + 3, argv + argc});
  trundle::require_apart(recordings, {argv[2]});  // the result goes over nothing that was recorded

  const trundle::CalibrationResult result = trundle::calibrate(recordings, {}, nominal);
  for (const trundle::ParameterEstimate& parameter : result.parameters)
    if (parameter.observable)
      std::printf("%s [%s]: %.6f +- %.6f, was %.6f\n", parameter.name.c_str(), parameter.unit.c_str(),
                  parameter.value, parameter.sigma_total, parameter.nominal);
  for (const std::string& what : result.unobservable) std::printf("not observable: %s\n", what.c_str());
  for (const std::string& warning : result.warnings) std::printf("warning: %s\n", warning.c_str());
  trundle::write_file(argv[2], trundle::to_toml(result.calibrated));
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), trundle::exit_code_of(error);
}
