#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/localize_answer.hpp"
#include "trundle/pipeline/outputs.hpp"
#include "trundle/pipeline/sentences.hpp"
#include "trundle/slam/map_file.hpp"

#include "binding.hpp"
#include "call.hpp"

namespace trundle::python {
namespace {

/// What read_map_file gives of the files that such a result is saved as.
MapFile map_of(const SlamAnswer& answer) {
  MapFile map{{}, {"landmarks.csv", sha256_of(to_csv(answer.map(), answer.input.landmarks))}};
  for (const LandmarkRow& row : landmark_rows_of(answer))
    map.landmarks.push_back({row.name, row.position, *row.covariance});
  if (answer.map_covariance().size() == 0) return map;
  map.covariance = answer.map_covariance();
  std::vector<std::string> names;
  for (const MapLandmark& landmark : map.landmarks) names.push_back(landmark.name);
  map.covariance_file =
      InputFile{"landmarks_covariance.csv", sha256_of(landmark_covariance_csv(names, map.covariance))};
  return map;
}

LocalizeAnswer localize(const RecordingFile& recording, const RobotFile& robot, const py::object& map,
                        LocalizeQuestion question, const std::string& filter) {
  if (filter != "ekf" && filter != "particles")
    throw InputError("filter", fmt::format("is '{}'", filter), "'ekf' or 'particles'");
  question.filter = filter == "ekf" ? LocalizerFilter::ekf : LocalizerFilter::particles;
  require_from("particles", static_cast<double>(question.particles), 1, 1e6);
  require_from("start_sigma_m", question.start_sigma_m, 0.0, 1e6);
  require_from("start_sigma_deg", question.start_sigma_deg, 0.0, 360.0);
  question.reading = recording.reading;
  const auto* const found = py::isinstance<SlamAnswer>(map) ? &map.cast<const SlamAnswer&>() : nullptr;
  const std::filesystem::path path =
      found != nullptr ? "" : path_of("map", map, "what slam gave, or the path of landmarks.csv");
  const MapFile known = found != nullptr ? without_gil([&] { return map_of(*found); })
                                         : by_library([&] { return read_map_file(path); });
  return by_library([&] { return answer_localize(recording.recording, robot, known, question); });
}

void save_localization(const LocalizeAnswer& self, const std::filesystem::path& path,
                       const std::filesystem::path& steps, const std::filesystem::path& innovations) {
  const auto files = [&] {
    std::vector<OutputFile> made = {trajectory_file(path, self.provenance, self.result.trajectory)};
    if (!steps.empty()) made.push_back({steps, steps_csv_of(self)});
    if (!innovations.empty()) made.push_back({innovations, innovations_csv_of(self)});
    return made;
  };
  save(files, self.provenance);
}

}  // namespace

void bind_localization(py::module_& module) {
  py::class_<KnownStretch>(module, "KnownStretch", "A stretch over which the pose is known.")
      .def_readonly("start_s", &KnownStretch::start_s)
      .def_readonly("end_s", &KnownStretch::end_s)
      .def_readonly("loss_noticed_s", &KnownStretch::noticed_s, "None: it lasts to the end.");
  py::class_<LocalizeAnswer> bound(module, "Localization", "Where the robot is on a known map.");
  bound
      .def_property_readonly(
          "trajectory",
          [](const LocalizeAnswer& self) -> const Trajectory& { return self.result.trajectory; },
          py::return_value_policy::reference_internal, "Where the pose is known.")
      .def_property_readonly("known", [](const LocalizeAnswer& self) { return self.result.stretches; })
      .def_property_readonly(
          "localized_s", [](const LocalizeAnswer& self) { return self.result.stretches.front().start_s; },
          "When the pose first became known.")
      .def_property_readonly("findings", [](const LocalizeAnswer& self) { return self.input.findings; })
      .def("save", &save_localization, py::arg("path"), py::kw_only(), py::arg("steps") = "",
           py::arg("innovations") = "",
           "Writes the trajectory, and what the filter did where a place for it is given.")
      .def("__repr__",
           [](const LocalizeAnswer& self) { return fmt::format("<Localization: {}>", sentence_of(self)); });
  add_document(bound, [](const LocalizeAnswer& answer) { return document_of(answer); });
  add_python_methods(bound, "A DataFrame with the columns of trajectory.csv.");

  module.attr("DEFAULT_LOCALIZATION_PARTICLES") = LocalizeQuestion{}.particles;
  module.def(
      "localize",
      [](const RecordingFile& recording, const RobotFile& robot, const py::object& map,
         const std::optional<StartTuple>& start, double start_sigma_m, double start_sigma_deg,
         const std::string& filter, std::size_t particles, std::uint64_t seed, bool unknown_ids,
         bool correct_slip, const py::iterable& learn, double spin_odds) {
        LocalizeQuestion question{.particles = particles,
                                  .seed = seed,
                                  .start_sigma_m = start_sigma_m,
                                  .start_sigma_deg = start_sigma_deg,
                                  .unknown_ids = unknown_ids};
        if (start) {
          const Start from = start_of(start);
          question.start = from.pose;
          question.start_text = from.text;
        }
        question.slip = slip_question_of(recording, correct_slip, learn, spin_odds);
        return localize(recording, robot, map, std::move(question), filter);
      },
      py::arg("recording"), py::arg("robot"), py::arg("map"), py::kw_only(), py::arg("start"),
      py::arg("start_sigma_m"), py::arg("start_sigma_deg"), py::arg("filter"), py::arg("particles"),
      py::arg("seed"), py::arg("unknown_ids"), py::arg("correct_slip"), py::arg("learn"),
      py::arg("spin_odds"));
}

}  // namespace trundle::python
