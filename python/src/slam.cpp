#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/outputs.hpp"
#include "trundle/pipeline/sentences.hpp"
#include "trundle/pipeline/slam_answer.hpp"

#include "binding.hpp"
#include "call.hpp"
#include "views.hpp"

namespace trundle::python {
namespace {

/// What is asked by name, and in ranges.
struct SlamArguments {
  std::string filter;
  std::optional<StartTuple> start;
  std::optional<std::string> estimate;
  std::optional<SlipQuestion> slip;
};

SlamMethod method_named(const std::string& name) {
  if (const auto method = slam_method_named(name)) return *method;
  std::string names;
  for (const std::string& known : slam_method_names()) names += (names.empty() ? "'" : ", '") + known + "'";
  throw InputError("filter", fmt::format("is '{}'", name), "one of " + names);
}

SlamAnswer slam(const RecordingFile& recording, const RobotFile& robot, SlamQuestion question,
                const SlamArguments& arguments) {
  question.method = method_named(arguments.filter);
  const Start start = start_of(arguments.start);
  question.start = start.pose;
  question.start_text = start.text;
  if (const auto& estimate = arguments.estimate) {
    if (*estimate != "best" && *estimate != "mean")
      throw InputError("estimate", fmt::format("is '{}'", *estimate), "'best' or 'mean'");
    question.estimate = *estimate == "best" ? PointEstimate::best : PointEstimate::mean;
  }
  require_from("particles", static_cast<double>(question.particles), 1, 1e6);
  require_from("threads", static_cast<double>(question.threads), 1, 256);
  require_from("smoother_runs", static_cast<double>(question.smoother_runs), 1, 100);
  require_from("swarm_iterations", question.swarm.iterations, 1, 1000);
  require_from("swarm_agreement", question.swarm.target_agreement, 0.0, 1.0);
  if (question.systematic_sigma) require_from("systematic_sigma", *question.systematic_sigma, 0.0, 10.0);
  question.reading = recording.reading;
  question.slip = arguments.slip;
  return without_gil([&] { return answer_slam(recording.recording, robot, question); });
}

std::vector<std::string> landmark_names_of(const SlamAnswer& answer) {
  std::vector<std::string> names;
  for (const MappedLandmark& landmark : answer.map())
    names.push_back(answer.input.landmarks[static_cast<std::size_t>(landmark.id)]);
  return names;
}

void save_slam(const SlamAnswer& answer, const std::filesystem::path& folder) {
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
      .def_property_readonly("landmarks", &landmark_names_of, "The names of the map's landmarks.")
      .def_property_readonly(
          "positions",
          [](const py::object& self) {
            return matrices(self, self.cast<const SlamAnswer&>().map(),
                            [](const MappedLandmark& row) -> const Vector2& { return row.position; });
          },
          "Of the landmarks, (n, 2) [m].")
      .def_property_readonly(
          "position_covariances",
          [](const py::object& self) {
            return matrices(self, self.cast<const SlamAnswer&>().map(),
                            [](const MappedLandmark& row) -> const Matrix2& { return row.covariance; });
          },
          "Of each landmark, (n, 2, 2) [m²].")
      .def_property_readonly(
          "map_covariance",
          [](const py::object& self) { return view(self, self.cast<const SlamAnswer&>().map_covariance()); },
          "Of all landmarks together, (2n, 2n); empty where the filter has none.")
      .def_property_readonly(
          "sightings",
          [](const py::object& self) {
            return column(self, self.cast<const SlamAnswer&>().map(),
                          [](const MappedLandmark& row) -> const std::size_t& { return row.sightings; });
          },
          "Of each landmark: how many.")
      .def_property_readonly("counts", [](const SlamAnswer& self) { return self.result.counts; })
      .def_property_readonly("findings", [](const SlamAnswer& self) { return self.input.findings; })
      .def_property_readonly(
          "inconsistencies", [](const SlamAnswer& self) { return self.inconsistencies; },
          "Of the run with its own sigmas: a filter that was lost, wrong noise.")
      .def("save", &save_slam, py::arg("folder"), "Writes the files of `trundle slam -o`.")
      .def("__repr__", [](const SlamAnswer& self) { return fmt::format("<Slam: {}>", sentence_of(self)); });
  add_document(bound, [](const SlamAnswer& answer) { return document_of(answer); });
  add_python_methods(bound, "A DataFrame with a row for each landmark.");

  module.def(
      "slam",
      [](const RecordingFile& recording, const RobotFile& robot, const std::string& filter,
         std::size_t particles, std::uint64_t seed, const std::optional<StartTuple>& start, bool smooth,
         std::size_t smoother_runs, bool unknown_ids, const std::optional<std::string>& estimate,
         std::optional<double> systematic_sigma, int swarm_iterations, double swarm_agreement,
         bool correct_slip, const py::iterable& learn, double spin_odds, std::size_t threads) {
        SlamQuestion question;
        question.particles = particles;
        question.seed = seed;
        question.smooth = smooth;
        question.smoother_runs = smoother_runs;
        question.unknown_ids = unknown_ids;
        question.systematic_sigma = systematic_sigma;
        question.swarm.iterations = swarm_iterations;
        question.swarm.target_agreement = swarm_agreement;
        question.threads = threads;
        return slam(recording, robot, std::move(question),
                    {filter, start, estimate, slip_question_of(recording, correct_slip, learn, spin_odds)});
      },
      py::arg("recording"), py::arg("robot"), py::kw_only(), py::arg("filter"), py::arg("particles"),
      py::arg("seed"), py::arg("start"), py::arg("smooth"), py::arg("smoother_runs"), py::arg("unknown_ids"),
      py::arg("estimate"), py::arg("systematic_sigma"), py::arg("swarm_iterations"),
      py::arg("swarm_agreement"), py::arg("correct_slip"), py::arg("learn"), py::arg("spin_odds"),
      py::arg("threads"));
}

}  // namespace trundle::python
