#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/outputs.hpp"
#include "trundle/pipeline/sentences.hpp"
#include "trundle/pipeline/slam_answer.hpp"
#include "trundle/pipeline/together_answer.hpp"

#include "binding.hpp"
#include "call.hpp"
#include "map_members.hpp"

namespace trundle::python {
namespace {

SlamMethod method_named(const std::string& name) {
  if (const auto method = slam_method_named(name)) return *method;
  std::string names;
  for (const std::string& known : slam_method_names()) names += (names.empty() ? "'" : ", '") + known + "'";
  throw InputError("filter", fmt::format("is '{}'", name), "one of " + names);
}

void require_in_range(const SlamQuestion& question) {
  require_from("particles", static_cast<double>(question.particles), 1, 1e6);
  require_from("threads", static_cast<double>(question.threads), 1, 256);
  require_from("smoother_runs", static_cast<double>(question.smoother_runs), 1, 100);
  require_from("swarm_iterations", question.swarm.iterations, 1, 1000);
  require_from("swarm_agreement", question.swarm.target_agreement, 0.0, 1.0);
  require_from("marker_sigma", question.marker_sigma_m, 0.0, 100.0);
  if (question.systematic_sigma) require_from("systematic_sigma", *question.systematic_sigma, 0.0, 10.0);
  if (question.window_s) require_from("window", *question.window_s, 0.0, kLargest);
  if (question.window_s && question.method != SlamMethod::smoother)
    throw InputError("window", fmt::format("is given with filter '{}'", name_of(question.method)),
                     "filter 'smoother'");
  if (const auto& every_s = question.checkpoints.every_s) {
    require_from("checkpoint_every_s", *every_s, kSmallest, kLargest);
    if (question.checkpoints.write.empty())
      throw InputError("checkpoint_every_s", "is given without checkpoint", "the file to store the run in");
  }
}

PointEstimate estimate_named(const std::string& name) {
  if (name != "best" && name != "mean")
    throw InputError("estimate", fmt::format("is '{}'", name), "'best' or 'mean'");
  return name == "best" ? PointEstimate::best : PointEstimate::mean;
}

using RecordingFiles = std::vector<const RecordingFile*>;
using RobotFiles = std::vector<const RobotFile*>;

/// Of one robot, which is the first.
SlamAnswer slam(const RecordingFiles& recordings, const RobotFiles& robots, const SlamQuestion& question) {
  return by_library([&] { return answer_slam(recordings.front()->recording, *robots.front(), question); });
}

TogetherAnswer slam_together(const RecordingFiles& recordings, const RobotFiles& robots,
                             const SlamQuestion& question) {
  if (recordings.size() < 2)
    throw InputError("recordings", fmt::format("are {}", recordings.size()), "those of two robots at least");
  if (robots.size() != 1 && robots.size() != recordings.size())
    throw InputError("robot",
                     fmt::format("is given {} times for {} recordings", robots.size(), recordings.size()),
                     "one for all, or one for each");
  std::vector<TeamRobot> team;
  without_gil([&] {
    for (std::size_t i = 0; i < recordings.size(); ++i)
      team.push_back({recordings[i]->recording, *robots[robots.size() == 1 ? 0 : i]});
  });
  return by_library([&] { return answer_together(std::move(team), question); });
}

template <class Answer>
void save_slam(const Answer& answer, const std::filesystem::path& folder) {
  without_gil([&] {
    ResultFolder results(folder);
    write_set(results, folder, interruptible(files_of(answer, folder)), answer.provenance.inputs,
              slam_file_names(), "slam.json");
  });
}

void bind_counts(py::module_& module) {
  py::class_<SlamCounts>(module, "SlamCounts", "Sightings by what became of them.")
      .def_readonly("matched", &SlamCounts::matched)
      .def_readonly("created", &SlamCounts::created)
      .def_readonly("rejected", &SlamCounts::rejected)
      .def_readonly("invalid", &SlamCounts::invalid)
      .def_readonly("mean_nis", &SlamCounts::mean_nis, "Of matched and rejected ones; 2 if consistent.")
      .def_readonly("median_nis", &SlamCounts::median_nis, "1.39 if consistent.");
}

/// The options of both: what only one of them takes need not be given for the other.
template <class Answer>
void def_slam(py::module_& module, const char* name, const Answer& answer) {
  module.def(
      name,
      [answer](const RecordingFiles& recordings, const RobotFiles& robots, const std::string& filter,
               std::size_t particles, std::uint64_t seed, const std::optional<StartTuple>& start, bool smooth,
               std::size_t smoother_runs, bool unknown_ids, const std::optional<std::string>& estimate,
               std::optional<double> systematic_sigma, int swarm_iterations, double swarm_agreement,
               std::optional<double> window, bool correct_slip, const py::iterable& learn, double spin_odds,
               std::size_t threads, double marker_sigma, const std::filesystem::path& checkpoint,
               std::optional<double> checkpoint_every_s, const std::filesystem::path& resume) {
        if (robots.empty()) throw InputError("robot", "names none", "a robot file for all, or one for each");
        const Start from = start_of(start);
        SlamQuestion question;
        question.method = method_named(filter);
        question.particles = particles;
        question.seed = seed;
        question.start = from.pose;
        question.start_text = from.text;
        question.smooth = smooth;
        question.smoother_runs = smoother_runs;
        question.unknown_ids = unknown_ids;
        if (estimate) question.estimate = estimate_named(*estimate);
        question.systematic_sigma = systematic_sigma;
        question.swarm.iterations = swarm_iterations;
        question.swarm.target_agreement = swarm_agreement;
        question.window_s = window;
        question.threads = threads;
        question.marker_sigma_m = marker_sigma;
        question.checkpoints = {checkpoint, checkpoint_every_s, resume};
        question.reading = recordings.front()->reading;
        if (recordings.size() > 1) question.reading.robot_number = 0;  // each has its own
        question.slip = slip_question_of(*recordings.front(), correct_slip, learn, spin_odds);
        require_in_range(question);
        return answer(recordings, robots, question);
      },
      py::arg("recordings"), py::arg("robots"), py::kw_only(), py::arg("filter"), py::arg("particles"),
      py::arg("seed"), py::arg("start"), py::arg("smooth") = false, py::arg("smoother_runs"),
      py::arg("unknown_ids"), py::arg("estimate"), py::arg("systematic_sigma"), py::arg("swarm_iterations"),
      py::arg("swarm_agreement"), py::arg("window") = py::none(), py::arg("correct_slip"), py::arg("learn"),
      py::arg("spin_odds"), py::arg("threads"), py::arg("marker_sigma") = 0.0, py::arg("checkpoint") = "",
      py::arg("checkpoint_every_s") = py::none(), py::arg("resume") = "");
}

void bind_joint_slam(py::module_& module) {
  py::class_<TogetherAnswer> bound(module, "JointSlam",
                                   "Trajectories of several robots and one map, with their covariances.");
  bound
      .def_property_readonly(
          "trajectories",
          [](const py::object& self) {
            const auto& answer = self.cast<const TogetherAnswer&>();
            py::dict trajectories;
            for (std::size_t i = 0; i < answer.names.size(); ++i)
              trajectories[py::str(answer.names[i])] = py::cast(
                  answer.joint.robots[i].trajectory, py::return_value_policy::reference_internal, self);
            return trajectories;
          },
          "Of each robot, by the name of its recording; in the frame of the first.")
      .def_property_readonly("findings", [](const TogetherAnswer& self) { return self.findings; })
      .def_property_readonly(
          "inconsistencies", [](const TogetherAnswer& self) { return self.inconsistencies; },
          "Of the run with its own sigmas: robots that contradict each other, wrong noise.")
      .def("save", &save_slam<TogetherAnswer>, py::arg("folder"),
           "Writes the files of `trundle slam --together -o`.")
      .def("__repr__", [](const TogetherAnswer& self) {
        return fmt::format("<JointSlam of {} robots: {} landmarks>", self.names.size(),
                           self.joint.map.size());
      });
  add_map(
      bound, [](const TogetherAnswer& self) -> const auto& { return self.joint.map; },
      [](const TogetherAnswer& self, const MappedLandmark& landmark) {
        return self.landmarks[static_cast<std::size_t>(landmark.id)];
      },
      [](const TogetherAnswer& self) -> const auto& { return self.joint.map_covariance; },
      "Of each landmark: how many.");
  add_document(bound, [](const TogetherAnswer& answer) { return document_of(answer); });
  add_python_methods(bound, "A DataFrame with a row for each landmark.");
}

}  // namespace

void bind_slam(py::module_& module) {
  bind_counts(module);
  py::class_<SlamAnswer> bound(module, "Slam",
                               "A trajectory and a map of landmarks, with their covariances.");
  bound
      .def_property_readonly(
          "trajectory", [](const SlamAnswer& self) -> const Trajectory& { return self.trajectory(); },
          py::return_value_policy::reference_internal, "The smoothed one where that was asked for.")
      .def_property_readonly(
          "online", [](const SlamAnswer& self) -> const Trajectory& { return self.result.online; },
          py::return_value_policy::reference_internal, "Each pose from what was seen up to then.")
      .def_property_readonly(
          "path", [](const SlamAnswer& self) { return self.result.path ? &*self.result.path : nullptr; },
          py::return_value_policy::reference_internal, "The best particle's; None of filters without.")
      .def_property_readonly("counts", [](const SlamAnswer& self) { return self.result.counts; })
      .def_property_readonly("findings", [](const SlamAnswer& self) { return self.input.findings; })
      .def_property_readonly(
          "inconsistencies", [](const SlamAnswer& self) { return self.inconsistencies; },
          "Of the run with its own sigmas: a filter that was lost, wrong noise.")
      .def("save", &save_slam<SlamAnswer>, py::arg("folder"), "Writes the files of `trundle slam -o`.")
      .def("__repr__", [](const SlamAnswer& self) { return fmt::format("<Slam: {}>", sentence_of(self)); });
  add_map(
      bound, [](const SlamAnswer& self) -> const auto& { return self.map(); },
      [](const SlamAnswer& self, const MappedLandmark& landmark) {
        return self.input.landmarks[static_cast<std::size_t>(landmark.id)];
      },
      [](const SlamAnswer& self) -> const auto& { return self.map_covariance(); },
      "Of each landmark: how many.");
  add_document(bound, [](const SlamAnswer& answer) { return document_of(answer); });
  add_python_methods(bound, "A DataFrame with a row for each landmark.");
  bind_joint_slam(module);
  def_slam(module, "slam", &slam);
  def_slam(module, "slam_together", &slam_together);
}

}  // namespace trundle::python
