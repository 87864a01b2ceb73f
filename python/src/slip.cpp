#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/outputs.hpp"
#include "trundle/pipeline/sentences.hpp"
#include "trundle/pipeline/slip_answer.hpp"

#include "binding.hpp"
#include "call.hpp"
#include "views.hpp"

namespace trundle::python {
namespace {

/// The slips, and the odometry that is corrected for them.
struct Slip {
  SlipAnswer answer;
  Robot robot;  ///< whose wheels they are of
  IntegratedOdometry corrected;
};

Slip slip(const RecordingFile& recording, const RobotFile& robot, SlipQuestion question,
          const std::string& method) {
  if (method != "general" && method != "published")
    throw InputError("method", fmt::format("is '{}'", method), "'general' or 'published'");
  question.method = method == "published" ? SlipMethod::published : SlipMethod::general;
  require_from("probability", question.probability, 1e-12, 0.5);
  require_from("interval_s", question.interval_s, 0.0, 60.0);
  require_from("spin_odds", question.spin_odds, 1e-6, 1e6);
  question.reading = recording.reading;
  SlipAnswer answer = by_library([&] { return answer_slip(recording.recording, robot, question); });
  IntegratedOdometry corrected =
      by_library([&] { return corrected_odometry(recording.recording, answer, robot.robot); });
  return {std::move(answer), robot.robot, std::move(corrected)};
}

void save_slip(const Slip& self, const std::filesystem::path& path, const std::filesystem::path& corrected) {
  const auto files = [&] {
    std::vector<OutputFile> made;
    if (!path.empty()) made.push_back({path, slip_csv_of(self.answer, self.robot)});
    if (!corrected.empty())
      made.push_back(trajectory_file(corrected, self.answer.provenance, self.corrected.trajectory));
    return made;
  };
  save(files, self.answer.provenance);
}

template <class Number>
auto interval_column(Number number) {
  return [number](const py::object& self) {
    return column(self, self.cast<const Slip&>().answer.report.intervals, number);
  };
}

void bind_slip_event(py::module_& module) {
  py::class_<SlipRow>(module, "SlipEvent", "A slip from its first interval to its last.")
      .def_readonly("start_s", &SlipRow::start_s)
      .def_readonly("end_s", &SlipRow::end_s)
      .def_readonly("wheel", &SlipRow::wheel, "Its name, or 'ambiguous'.")
      .def_readonly("kind", &SlipRow::kind, "'spin', 'skid', 'stuck', 'sideways' or 'unknown'.")
      .def_readonly("excess_m", &SlipRow::excess_m, "Wheel travel minus ground travel.")
      .def_readonly("excess_sigma_m", &SlipRow::excess_sigma_m)
      .def_readonly("confidence", &SlipRow::confidence, "Posterior probability of that wheel.")
      .def_readonly("by_chance", &SlipRow::by_chance,
                    "Share of those as clear as this one that noise alone makes.")
      .def("__repr__", [](const SlipRow& self) {
        return fmt::format("<{} of '{}' from {:.3f} to {:.3f} s, {:+.4f} m>", self.kind, self.wheel,
                           self.start_s, self.end_s, self.excess_m);
      });
}

}  // namespace

void take_clean(const py::iterable& learn, SlipQuestion& question) {
  for (const py::handle& one : learn)
    if (py::isinstance<RecordingFile>(one))
      question.clean.push_back(copy_of(one.cast<const RecordingFile&>()));
    else
      question.learn.push_back(path_of("learn", one, "recordings without slip, or their paths").string());
}

std::optional<SlipQuestion> slip_question_of(const RecordingFile& recording, bool correct_slip,
                                             const py::iterable& learn, double spin_odds) {
  if (!correct_slip) return std::nullopt;
  require_from("spin_odds", spin_odds, 1e-6, 1e6);
  SlipQuestion question{.spin_odds = spin_odds, .reading = recording.reading};
  take_clean(learn, question);
  return question;
}

void bind_slip(py::module_& module) {
  bind_slip_event(module);
  py::class_<Slip> bound(module, "Slip", "Where wheels slip, and the odometry that is corrected for it.");
  bound
      .def_property_readonly("events",
                             [](const Slip& self) { return slip_result_of(self.answer, self.robot).events; })
      .def_property_readonly(
          "clear",
          [](const Slip& self) {
            std::vector<SlipRow> events = slip_result_of(self.answer, self.robot).events;
            std::erase_if(events, [](const SlipRow& event) { return !is_clear(*event.by_chance); });
            return events;
          },
          "Those of the events that noise alone hardly makes: `by_chance` below 0.05.")
      .def_property_readonly(
          "trajectory", [](const Slip& self) -> const Trajectory& { return self.corrected.trajectory; },
          py::return_value_policy::reference_internal, "Corrected for the slips.")
      .def_property_readonly(
          "limit", [](const Slip& self) { return self.answer.report.chi2_limit; },
          "Beyond it `statistic` raises an alarm; of the published method 0, which has a band.")
      .def_property_readonly(
          "end_s", interval_column([](const SlipInterval& row) -> const double& { return row.end_s; }),
          "Of each interval that was judged or passed over.")
      .def_property_readonly("statistic", interval_column([](const SlipInterval& row) -> const double& {
                               return row.statistic;
                             }),
                             "What an interval was judged by: chi squared; 0 where it was not.")
      .def_property_readonly(
          "slipping", interval_column([](const SlipInterval& row) -> const bool& { return row.slipping; }),
          "Whether an interval is within a slip.")
      .def_property_readonly(
          "flagged_share", [](const Slip& self) { return self.answer.report.counts.flagged_share(); },
          "Of the intervals that were judged.")
      .def_property_readonly("findings", [](const Slip& self) { return self.answer.report.findings; })
      .def("save", &save_slip, py::arg("path") = "", py::kw_only(), py::arg("corrected") = "",
           "Writes slip.csv, and the corrected trajectory where a place for it is given.")
      .def("__repr__", [](const Slip& self) {
        return fmt::format("<Slip: {}>", sentence_of(self.answer, self.corrected));
      });
  add_document(bound, [](const Slip& self) { return document_of(self.answer, self.robot); });
  add_python_methods(bound, "A DataFrame with a row for each slip.");

  module.def(
      "slip",
      [](const RecordingFile& recording, const RobotFile& robot, const py::iterable& learn,
         double probability, const std::string& method, double interval_s, double spin_odds) {
        SlipQuestion question{.probability = probability, .interval_s = interval_s, .spin_odds = spin_odds};
        take_clean(learn, question);
        return slip(recording, robot, std::move(question), method);
      },
      py::arg("recording"), py::arg("robot"), py::kw_only(), py::arg("learn"), py::arg("probability"),
      py::arg("method"), py::arg("interval_s"), py::arg("spin_odds"));
}

}  // namespace trundle::python
