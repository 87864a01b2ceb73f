#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/merge_answer.hpp"
#include "trundle/pipeline/outputs.hpp"

#include "binding.hpp"
#include "call.hpp"
#include "map_members.hpp"

namespace trundle::python {
namespace {

/// Maps as one, and its landmarks, whose memory the arrays show.
struct Merge {
  MergeAnswer answer;
  std::vector<MappedLandmark> landmarks;
};

Merge merge(std::vector<std::string> maps, bool unknown_ids) {
  if (maps.size() < 2) throw InputError("maps", fmt::format("are {}", maps.size()), "two at least");
  const MergeQuestion question{.maps = std::move(maps), .unknown_ids = unknown_ids};
  MergeAnswer answer = by_library([&] { return answer_merge(question); });
  std::vector<MappedLandmark> landmarks = without_gil([&] { return landmarks_of(answer.merged); });
  return {std::move(answer), std::move(landmarks)};
}

void save_merge(const Merge& self, const std::filesystem::path& folder) {
  without_gil([&] {
    ResultFolder results(folder);
    write_set(results, folder, files_of(self.answer, folder), self.answer.provenance.inputs, {"slam.json"},
              "merge.json");
  });
}

}  // namespace

void bind_merge(py::module_& module) {
  py::class_<Merge> bound(module, "Merge",
                          "Maps of several robots or runs as one, in the frame of the first.");
  bound
      .def_property_readonly(
          "maps", [](const Merge& self) { return self.answer.maps; }, "As they were given.")
      .def_property_readonly(
          "frames", [](const Merge& self) { return self.answer.merged.first_from_map; },
          "Where the frame of each map lies in that of the first.")
      .def_property_readonly(
          "frame_covariances",
          [](const py::object& self) {
            return matrices(self, self.cast<const Merge&>().answer.merged.frame_covariance,
                            [](const Matrix3& row) -> const Matrix3& { return row; });
          },
          "Of each frame's (x, y, heading) in the axes of the first, (maps, 3, 3) [m, m, rad].")
      .def_property_readonly(
          "cost", [](const Merge& self) { return self.answer.merged.cost; },
          "Chi squared of all maps' landmarks about the merged ones: near `degrees_of_freedom` if "
          "consistent.")
      .def_property_readonly("degrees_of_freedom",
                             [](const Merge& self) { return self.answer.merged.degrees_of_freedom; })
      .def("save", &save_merge, py::arg("folder"), "Writes the files of `trundle merge -o`.")
      .def("__repr__", [](const Merge& self) {
        return fmt::format("<Merge of {} maps: {} landmarks>", self.answer.maps.size(),
                           self.landmarks.size());
      });
  add_map(
      bound, [](const Merge& self) -> const auto& { return self.landmarks; },
      [](const Merge& self, const MappedLandmark& landmark) {
        return self.answer.merged.map.names[static_cast<std::size_t>(landmark.id)];
      },
      [](const Merge& self) -> const auto& { return self.answer.merged.map.covariance; },
      "Of each landmark: how many maps have it.");
  add_document(bound, [](const Merge& self) { return document_of(self.answer); });
  add_python_methods(bound, "A DataFrame with a row for each landmark.");
  module.def("merge", &merge, py::arg("maps"), py::kw_only(), py::arg("unknown_ids"));
}

}  // namespace trundle::python
