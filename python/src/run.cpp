#include "trundle/pipeline/run.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/report_answer.hpp"
#include "trundle/pipeline/simulation_answer.hpp"
#include "trundle/report/json_text.hpp"
#include "trundle/report/page.hpp"

#include "binding.hpp"
#include "call.hpp"

namespace trundle::python {
namespace {

/// What a run found, and where its files are.
struct Run {
  RunAnswer answer;
  std::string folder;
};

Run run(RunQuestion question, const std::string& filter) {
  const auto method = slam_method_named(filter);
  if (!method) throw InputError("filter", fmt::format("is '{}'", filter), "the name of a filter");
  question.slam.method = *method;
  require_from("spin_odds", question.spin_odds, 1e-6, 1e6);
  RunAnswer answer = by_library([&] { return pipeline::run(question); });
  if (const auto& failure = answer.no_odometry) {
    if (failure->kind == kCannotAnswer) throw CannotAnswer(failure->message);
    throw py::value_error(failure->message);
  }
  return {std::move(answer), question.output.string()};
}

void bind_run_result(py::module_& module) {
  py::class_<Stage>(module, "Stage", "A stage of a run.")
      .def_property_readonly("name", [](const Stage& self) { return std::string(name_of(self)); })
      .def_property_readonly(
          "status", [](const Stage& self) { return std::string(name_of(self.status)); },
          "'done', 'skipped' or 'failed'.")
      .def_readonly("message", &Stage::message, "What came out, or why nothing did.")
      .def_readonly("remarks", &Stage::remarks)
      .def_readonly("outputs", &Stage::outputs, "Files, relative to the folder.")
      .def("__repr__", [](const Stage& self) {
        return fmt::format("<{}: {}: {}>", name_of(self), name_of(self.status), self.message);
      });
  py::class_<PositionError>(module, "PositionError", "Of a trajectory, against the reference.")
      .def_readonly("trajectory", &PositionError::trajectory)
      .def_property_readonly("alignment",
                             [](const PositionError& self) { return std::string(name_of(self.alignment)); })
      .def_readonly("rms_m", &PositionError::rms_m);
  py::class_<Run> bound(module, "Run",
                        "What `trundle run` found, stage by stage; its files are in `folder`.");
  bound.def_readonly("folder", &Run::folder)
      .def_property_readonly("stages", [](const Run& self) { return self.answer.record.stages; })
      .def_property_readonly("errors", [](const Run& self) { return self.answer.errors; })
      .def_property_readonly(
          "recordings", [](const Run& self) { return self.answer.record.recordings; },
          "Of a session: their folders below `folder`.")
      .def("__repr__", [](const Run& self) {
        const auto done = std::ranges::count(self.answer.record.stages, StageStatus::done, &Stage::status);
        return fmt::format("<Run in {}: {} of {} stages done>", self.folder, done,
                           self.answer.record.stages.size());
      });
  add_document(bound, [](const Run& self) { return to_json(self.answer.record); });
  add_python_methods(bound, "A DataFrame with a row for each stage.");
}

/// The page, and what it was drawn from.
struct Report {
  ReportAnswer answer;
  std::string html() const { return report_page(answer.document); }
};

void save_report(const Report& self, const std::filesystem::path& path) {
  const bool json = path.extension() == ".json";
  const auto files = [&] {
    return std::vector<OutputFile>{{path, json ? json_text(self.answer.document) : self.html()}};
  };
  save(files, self.answer.provenance);
}

void bind_report(py::module_& module) {
  py::class_<Report> bound(module, "Report", "Results drawn as one page of HTML that opens from disk.");
  bound
      .def_property_readonly("html",
                             [](const Report& self) { return by_library([&] { return self.html(); }); })
      .def("save", &save_report, py::arg("path"),
           "Writes the page; what it draws, where the name ends in .json.")
      .def("__repr__", [](const Report& self) {
        return fmt::format("<Report of {} files>", self.answer.provenance.inputs.size());
      });
  add_document(bound, [](const Report& self) { return self.answer.document; });
  add_python_methods(bound, "A DataFrame with a row for each trajectory.");
  module.def(
      "report",
      [](std::vector<std::string> results, std::string reference, std::string robot) {
        if (results.empty()) throw InputError("results", "name no folder", "folders or files of results");
        const ReportQuestion question{std::move(results), std::move(reference), std::move(robot)};
        return by_library([&] { return Report{answer_report(question)}; });
      },
      py::arg("results"), py::kw_only(), py::arg("reference"), py::arg("robot"));
}

}  // namespace

void bind_run(py::module_& module) {
  bind_run_result(module);
  bind_report(module);
  module.def(
      "run",
      [](const std::string& recording, const std::string& robot, const std::string& folder,
         std::vector<std::string> calibrate_on, std::vector<std::string> free, std::vector<std::string> fix,
         std::vector<std::string> learn, double spin_odds, const std::string& map, const std::string& filter,
         std::size_t particles, std::uint64_t seed, const std::optional<std::string>& export_format,
         int robot_number, const std::string& recording_map, std::vector<std::string> msg_path) {
        RunQuestion question{.recording = recording, .robot = robot, .output = folder};
        question.calibrate_on = std::move(calibrate_on);
        question.calibrate.free = std::move(free);
        question.calibrate.fix = std::move(fix);
        question.learn = std::move(learn);
        question.spin_odds = spin_odds;
        question.map = map;
        question.slam.particles = particles;
        question.slam.seed = seed;
        if (export_format && !(question.viewer = viewer_format_named(*export_format)))
          throw InputError("export", fmt::format("is '{}'", *export_format), "'mcap' or 'wpilog'");
        question.reading = {
            .robot_number = robot_number, .map = recording_map, .msg_path = std::move(msg_path)};
        return run(std::move(question), filter);
      },
      py::arg("recording"), py::arg("robot"), py::arg("folder"), py::kw_only(), py::arg("calibrate_on"),
      py::arg("free"), py::arg("fix"), py::arg("learn"), py::arg("spin_odds"), py::arg("map"),
      py::arg("filter"), py::arg("particles"), py::arg("seed"), py::arg("export"), py::arg("robot_number"),
      py::arg("recording_map"), py::arg("msg_path"));
  module.def(
      "simulate",
      [](const std::string& scenario, const std::string& folder, std::optional<std::uint64_t> seed) {
        return python_of(by_library([&] {
          const Plan plan = read_plan(scenario, seed);
          write_simulation(plan, folder);
          return document_of(plan, folder);
        }));
      },
      py::arg("scenario"), py::arg("folder"), py::kw_only(), py::arg("seed"));
}

}  // namespace trundle::python
