#include <cmath>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/slam/models/metre.hpp"
#include "trundle/slam/models/systematic_errors.hpp"
#include "trundle/slam/smoothing/incremental_smoother.hpp"
#include "trundle/slam/steps.hpp"

#include "binding.hpp"
#include "call.hpp"
#include "views.hpp"

namespace trundle::python {
namespace {

/// Of a recording: a motion and what was seen at its end, with the landmarks' names.
struct Step {
  SlamStep step;
  std::vector<std::string> seen;  ///< the landmark of each observation; empty: unknown
};

/// What was made of a sighting.
struct SightingReport {
  Decision decision;
  std::string landmark;
  double nis;
};

Matrix3 matrix3_of(const py::array_t<double, py::array::forcecast>& numbers) {
  if (numbers.ndim() != 2 || numbers.shape(0) != 3 || numbers.shape(1) != 3)
    throw InputError("covariance", "is no 3 by 3 matrix", "that of (forward, left, turn)");
  Matrix3 matrix;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) matrix(i, j) = numbers.at(i, j);
  return matrix;
}

/// Landmarks without names are numbered from here on: above all that have one.
constexpr LandmarkId kFirstUnidentified = 1 << 24;

/// The smoother that goes along, and the names of its landmarks.
class Smoother {
 public:
  Smoother(const RobotFile& robot, const std::optional<StartTuple>& start)
      : sensor_(sensor_of(robot)),
        metre_(metre_of(robot.robot, start_of(start).pose)),
        smoother_(sensor_, options_of(robot, start)) {}

  std::vector<SightingReport> step(const Step& step) {
    std::vector<Observation> observations = step.step.observations;
    for (std::size_t i = 0; i < observations.size(); ++i) observations[i].landmark = id_of(step.seen[i]);
    return step_by(step.step.motion, observations, step.step.bias_reading);
  }

  using Sighting = std::tuple<std::optional<std::string>, double, double>;
  std::vector<SightingReport> add(const Pose2& motion, const Matrix3& covariance,
                                  const std::vector<Sighting>& sightings) {
    std::vector<Observation> observations;
    for (const auto& [name, range_m, bearing_rad] : sightings)
      observations.push_back(observation_of(sensor_, id_of(name.value_or("")), range_m, bearing_rad));
    Motion moved;
    moved.mean = motion;
    moved.covariance = covariance;
    return step_by(moved, observations, {});
  }

  PoseEstimate estimate() const {
    PoseEstimate estimate = smoother_.estimate();
    metre_.add_to(estimate);
    return estimate;
  }

  /// By name: position and its covariance.
  py::dict landmarks() const {
    py::dict map;
    for (std::size_t i = 0; i < smoother_.landmarks(); ++i) {
      if (!smoother_.is_confirmed(i)) continue;
      const MappedLandmark landmark = smoother_.landmark(i);
      map[py::str(name_of(landmark.id))] =
          py::make_tuple(copied(landmark.position), copied(landmark.covariance));
    }
    return map;
  }

  Eigen::MatrixXd map_covariance() const {
    std::vector<std::size_t> confirmed;
    for (std::size_t i = 0; i < smoother_.landmarks(); ++i)
      if (smoother_.is_confirmed(i)) confirmed.push_back(i);
    return smoother_.map_covariance(confirmed);
  }

 private:
  static const LandmarkSensor& sensor_of(const RobotFile& robot) {
    if (!robot.robot.landmark_sensor)
      throw InputError(place_of(robot.robot), "has no [landmark_sensor]", "one, to see landmarks by");
    return *robot.robot.landmark_sensor;
  }

  static slam::IncrementalSmootherOptions options_of(const RobotFile& robot,
                                                     const std::optional<StartTuple>& start) {
    const SystematicErrors systematic = systematic_errors_of(robot.robot, false);
    return {.prior = {.start = start_of(start).pose, .systematic_sigma = systematic.sigma()},
            .has_bias = systematic.has_bias,
            .first_unidentified = kFirstUnidentified};
  }

  LandmarkId id_of(const std::string& name) {
    if (name.empty()) return kUnknownLandmark;
    const auto [at, is_new] = ids_.try_emplace(name, static_cast<LandmarkId>(names_.size()));
    if (is_new) names_.push_back(name);
    return at->second;
  }
  std::string name_of(LandmarkId id) const {
    if (id < 0) return {};
    return id < kFirstUnidentified ? names_[static_cast<std::size_t>(id)]
                                   : std::to_string(id - kFirstUnidentified + 1);
  }

  std::vector<SightingReport> step_by(const Motion& motion, const std::vector<Observation>& observations,
                                      const std::optional<BiasReading>& bias) {
    std::vector<SightingReport> reports;
    for (const ObservationReport& report : smoother_.step(motion, observations).observations)
      reports.push_back({report.decision, name_of(report.landmark), report.nis});
    if (bias) smoother_.read_bias(*bias);
    return reports;
  }

  LandmarkSensor sensor_;
  Metre metre_;
  slam::IncrementalSmoother smoother_;
  std::map<std::string, LandmarkId> ids_;
  std::vector<std::string> names_;
};

std::vector<Step> steps_of(const RecordingFile& recording, const RobotFile& robot, bool unknown_ids) {
  const SlamInput input =
      by_library([&] { return slam_input(recording.recording, robot.robot, {.hide_ids = unknown_ids}); });
  return without_gil([&] {
    std::vector<Step> steps;
    for (const SlamStep& step : input.steps) {
      check_interruption();
      Step& named = steps.emplace_back(Step{step, {}});
      for (const Observation& seen : step.observations)
        named.seen.push_back(seen.landmark < 0 ? ""
                                               : input.landmarks[static_cast<std::size_t>(seen.landmark)]);
    }
    return steps;
  });
}

const char* name_of(Decision decision) {
  constexpr std::array kNames = {"matched", "created", "rejected", "invalid"};
  return kNames[static_cast<std::size_t>(decision)];
}

void bind_step(py::module_& module) {
  py::class_<Step>(module, "Step", "How the robot moved since the step before, and what it saw at the end.")
      .def_property_readonly("time_s", [](const Step& self) { return self.step.time_s; })
      .def_property_readonly(
          "motion", [](const Step& self) { return self.step.motion.mean; },
          "From the frame before to that at the end.")
      .def_property_readonly(
          "covariance",
          [](const py::object& self) { return view(self, self.cast<const Step&>().step.motion.covariance); },
          "Of (forward, left, turn) in the frame at the end.")
      .def_property_readonly(
          "sightings",
          [](const Step& self) {
            py::list sightings;
            for (std::size_t i = 0; i < self.seen.size(); ++i) {
              const Observation& seen = self.step.observations[i];
              const py::object name = self.seen[i].empty() ? py::object(py::none()) : py::str(self.seen[i]);
              sightings.append(py::make_tuple(name, seen.range_m, seen.bearing_rad));
            }
            return sightings;
          },
          "(landmark or None, range_m, bearing_rad), the sensor's offsets taken out.");
  module.def("steps", &steps_of, py::arg("recording"), py::arg("robot"), py::kw_only(),
             py::arg("unknown_ids"));
  py::class_<SightingReport>(module, "SightingReport", "What became of a sighting.")
      .def_property_readonly(
          "decision", [](const SightingReport& self) { return name_of(self.decision); },
          "'matched', 'created', 'rejected' or 'invalid'.")
      .def_readonly("landmark", &SightingReport::landmark)
      .def_readonly("nis", &SightingReport::nis, "Innovation squared in its own covariance; 2 on average.");
}

}  // namespace

void bind_smoother(py::module_& module) {
  bind_step(module);
  py::class_<Smoother>(module, "IncrementalSmoother",
                       "All poses and landmarks by least squares, as the robot drives: after each step the\n"
                       "estimate is that of everything so far. `trundle slam --filter smoother` steps it so.")
      .def(py::init([](const py::object& robot, const std::optional<StartTuple>& start) {
             return Smoother(robot_given(robot), start);
           }),
           py::arg("robot"), py::kw_only(), py::arg("start") = py::none())
      .def(
          "step", [](Smoother& self, const Step& step) { return self.step(step); }, py::arg("step"),
          "One of trundle.steps().")
      .def(
          "add",
          [](Smoother& self, const Pose2& motion, const py::array_t<double, py::array::forcecast>& covariance,
             const std::vector<Smoother::Sighting>& sightings) {
            return self.add(motion, matrix3_of(covariance), sightings);
          },
          py::arg("motion"), py::arg("covariance"), py::arg("sightings") = std::vector<Smoother::Sighting>{},
          "A motion, its covariance of (forward, left, turn) in the frame at its end, and what was seen\n"
          "there: (landmark or None, range_m, bearing_rad).")
      .def_property_readonly("pose", [](const Smoother& self) { return self.estimate().pose; })
      .def_property_readonly(
          "covariance", [](const Smoother& self) { return copied(self.estimate().covariance); },
          "Of (x, y, heading) in world axes.")
      .def_property_readonly("landmarks", &Smoother::landmarks, "By name: position and its covariance.")
      .def(
          "map_covariance", [](const Smoother& self) { return copied(self.map_covariance()); },
          "Of all landmarks together: as costly as smoothing all of it once.")
      .def("__copy__", [](const Smoother& self) { return self; })
      .def(
          "__deepcopy__", [](const Smoother& self, const py::dict&) { return self; }, py::arg("memo"));
}

}  // namespace trundle::python
