// Calibrates a robot from recordings with a reference (motion capture, surveyed poses, a tape measure):
// wheels and gyro with error bars, written as the robot file that the other examples take. In the root of the
// repository:
//   example_calibrate data/demo/robot.toml out/calibrated.toml data/demo/session_01 data/demo/session_03
#include "trundle/calibration/calibrate.hpp"

#include <cstdio>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"
#include "trundle/pipeline/files.hpp"

using namespace trundle::pipeline;

int main(int argc, char** argv) try {
  if (argc < 4)
    return std::fputs("usage: example_calibrate robot.toml calibrated.toml RECORDING...\n", stderr), 2;
  const Robot nominal = read_robot(argv[1]);
  // Of folders with several recordings, all; those below one folder are one session.
  const std::vector<Recording> recordings = read_recordings({argv + 3, argv + argc});
  require_apart(recordings, {argv[2]});  // the result goes over nothing that was recorded

  const CalibrationResult result = calibrate(recordings, {}, nominal);
  for (const ParameterEstimate& parameter : result.parameters)
    if (parameter.observable)
      std::printf("%s [%s]: %.6f +- %.6f, was %.6f\n", parameter.name.c_str(), parameter.unit.c_str(),
                  parameter.value, parameter.sigma_total, parameter.nominal);
  for (const std::string& what : result.unobservable) std::printf("not observable: %s\n", what.c_str());
  for (const std::string& warning : result.warnings) std::printf("warning: %s\n", warning.c_str());
  write_file(argv[2], to_toml(result.calibrated));
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), exit_code_of(error);
}
