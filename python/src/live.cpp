#include "trundle/pipeline/live.hpp"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "binding.hpp"
#include "views.hpp"

namespace trundle::python {
namespace {

/// A live odometer, its robot for the names of wheels, and its settings for checkpoints.
struct Odometer {
  RobotFile robot;
  LiveOdometer odometer;
  std::string settings;
};

Odometer odometer_of(const py::object& given, const std::optional<StartTuple>& start, double probability,
                     double spin_odds, double longest_step_s) {
  const RobotFile robot = robot_given(given);
  require_from("probability", probability, 1e-12, 0.5);
  require_from("spin_odds", spin_odds, 1e-6, 1e6);
  require_from("longest_step_s", longest_step_s, kSmallest, kLargest);
  const Start from = start_of(start);
  const LiveOptions options{.start = from.pose,
                            .slip = {.probability = probability, .spin_odds = spin_odds},
                            .alignment = {.shortest_gap_s = longest_step_s}};
  return {robot, LiveOdometer(robot.robot, options),
          fmt::format("{} start={} probability={} spin-odds={} longest-step-s={}", robot.file.sha256,
                      from.text, probability, spin_odds, longest_step_s)};
}

std::vector<LiveEstimate> add(Odometer& self, double time_s, const std::map<std::string, double>& wheels,
                              std::optional<double> yaw_rate_rad_s) {
  LiveLine line{time_s, {wheels.begin(), wheels.end()}, yaw_rate_rad_s};
  std::vector<LiveEstimate> estimates;
  self.odometer.take(line, fmt::format("{} s", time_s), estimates);
  return estimates;
}

std::vector<LiveEstimate> add_line(Odometer& self, const std::string& text) {
  std::vector<LiveEstimate> estimates;
  self.odometer.take(parse_live_line(text, "line"), "line", estimates);
  return estimates;
}

std::vector<LiveEstimate> finish(Odometer& self) {
  std::vector<LiveEstimate> estimates;
  self.odometer.finish(estimates);
  return estimates;
}

void bind_estimate(py::module_& module) {
  py::class_<LiveEstimate>(module, "Estimate", "What is known after one reading of the wheels.")
      .def_readonly("time_s", &LiveEstimate::time_s)
      .def_property_readonly(
          "pose", [](const LiveEstimate& self) { return self.best_pose(); },
          "Corrected for slip where that is known.")
      .def_property_readonly(
          "covariance",
          [](const py::object& self) {
            return view(self, self.cast<const LiveEstimate&>().best_covariance());
          },
          "Of (x, y, heading) in world axes.")
      .def_readonly("uncorrected_pose", &LiveEstimate::pose, "From the readings as they are.")
      .def_property_readonly(
          "uncorrected_covariance",
          [](const py::object& self) { return view(self, self.cast<const LiveEstimate&>().covariance); })
      .def_readonly("at_rest", &LiveEstimate::at_rest)
      .def_property_readonly("slipping", &LiveEstimate::slipping, "As far as is known by now.")
      .def_property_readonly("gyro_bias_rad_s",
                             [](const LiveEstimate& self) {
                               return self.gyro_bias ? std::optional(self.gyro_bias->rad_s) : std::nullopt;
                             })
      .def_property_readonly("gyro_bias_sigma_rad_s",
                             [](const LiveEstimate& self) {
                               return self.gyro_bias ? std::optional(std::sqrt(self.gyro_bias->variance))
                                                     : std::nullopt;
                             })
      .def(
          "line", [](const LiveEstimate& self, const RobotFile& robot) { return line_of(self, robot.robot); },
          py::arg("robot"), "The line that `trundle live` prints.")
      .def("__repr__", [](const LiveEstimate& self) {
        const Pose2& pose = self.best_pose();
        return fmt::format("<Estimate at {:.3f} s: x {:.4f} m, y {:.4f} m, heading {:.4f} rad{}>",
                           self.time_s, pose.x, pose.y, pose.heading, self.slipping() ? ", slipping" : "");
      });
}

}  // namespace

void bind_live(py::module_& module) {
  bind_estimate(module);
  py::class_<Odometer>(
      module, "Odometer",
      "Odometry with covariance, the gyro's bias and slip, reading by reading: the numbers of\n"
      "`trundle live`, and of `odometry` and `slip` afterwards.")
      .def(py::init(&odometer_of), py::arg("robot"), py::kw_only(), py::arg("start") = py::none(),
           py::arg("probability") = SlipOptions{}.probability, py::arg("spin_odds") = SlipOptions{}.spin_odds,
           py::arg("longest_step_s") = AlignerOptions{}.shortest_gap_s)
      .def("add", &add, py::arg("time_s"), py::arg("wheels") = std::map<std::string, double>{},
           py::arg("yaw_rate_rad_s") = py::none(),
           "Takes readings of one instant, by the names of their columns, and returns the estimates that\n"
           "they complete: usually one for each reading of the wheels.")
      .def("add_line", &add_line, py::arg("line"), "The same of a line as `trundle live` reads it.")
      .def("finish", &finish, "Estimates of what waited for further readings.")
      .def(
          "save",
          [](const Odometer& self, const std::filesystem::path& path) {
            without_gil([&] { write_live_checkpoint(path, self.settings, self.odometer); });
          },
          py::arg("path"), "Stores its state.")
      .def(
          "resume",
          [](Odometer& self, const std::filesystem::path& path) {
            read_live_checkpoint(path, self.settings, self.odometer);
          },
          py::arg("path"), "Goes on from a state that an odometer of the same robot and options stored.")
      .def("__copy__", [](const Odometer& self) { return self; })
      .def(
          "__deepcopy__", [](const Odometer& self, const py::dict&) { return self; }, py::arg("memo"));
}

}  // namespace trundle::python
