#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/pipeline/init_answer.hpp"

#include "binding.hpp"
#include "call.hpp"

namespace trundle::python {

void bind_init(py::module_& module) {
  py::class_<InitAnswer> bound(module, "Drafts", "The drafts of robot.toml and recording.toml for a log.");
  bound
      .def_property_readonly(
          "files",
          [](const InitAnswer& self) {
            std::vector<std::string> files;
            for (const OutputFile& file : self.files) files.push_back(file.path.string());
            return files;
          },
          "Where the two were written.")
      .def_property_readonly(
          "to_fill_in", [](const InitAnswer& self) { return self.draft.to_fill_in; },
          "What the log does not say, line by line.")
      .def_property_readonly(
          "notes", [](const InitAnswer& self) { return self.draft.notes; }, "What was assumed.")
      .def("__repr__", [](const InitAnswer& self) {
        return fmt::format("<Drafts in {}: {} streams, {} lines to fill in>",
                           self.files.front().path.parent_path().string(), self.draft.streams.size(),
                           self.draft.to_fill_in.size());
      });
  add_document(bound, [](const InitAnswer& answer) { return document_of(answer); });
  module.def(
      "init",
      [](const std::filesystem::path& log, const std::filesystem::path& folder, std::string urdf,
         std::string controller, std::vector<std::filesystem::path> msg_path) {
        const InitQuestion question{.log = log,
                                    .folder = folder,
                                    .urdf = std::move(urdf),
                                    .controller = std::move(controller),
                                    .message_folders = std::move(msg_path)};
        return by_library([&] {
          InitAnswer answer = answer_init(question);
          write_files(answer.files, answer.provenance.inputs);
          return answer;
        });
      },
      py::arg("log"), py::arg("folder"), py::kw_only(), py::arg("urdf"), py::arg("controller"),
      py::arg("msg_path"));
}

}  // namespace trundle::python
