#include "commands.hpp"

#include "command.hpp"
#include "live.hpp"

namespace trundle::app {

void add_commands(CLI::App& app) {
  app.name("trundle");
  app.description(
      "Calibrated wheels, odometry with its covariance and maps from a wheeled robot's own recordings");
  app.set_version_flag("--version", TRUNDLE_VERSION);
  app.require_subcommand(0, 1);
  add_run(app);
  add_info(app);
  add_init(app);
  add_calibrate(app);
  add_umbmark(app);
  add_install_angle(app);
  add_odometry(app);
  add_slip(app);
  add_slam(app);
  add_merge(app);
  add_localize(app);
  add_evaluate(app);
  add_simulate(app);
  add_live(app);
  add_report(app);
  refuse_empty_values(app);
}

}  // namespace trundle::app
