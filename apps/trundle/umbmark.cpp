#include <memory>

#include "trundle/pipeline/umbmark_answer.hpp"

#include "calibration_output.hpp"
#include "command.hpp"

namespace trundle::app {
namespace {

struct UmbmarkArguments {
  UmbmarkQuestion question;
  std::string robot;
  std::string method = "orientation";
  CalibrationOutput output;
  Common common;
};

void run(const UmbmarkArguments& options) {
  const RobotFile nominal = read_robot_file(options.robot);
  UmbmarkQuestion question = options.question;
  question.method = *square_method_named(options.method);
  question.export_format = options.output.export_format;
  if (!is_sheet(question) && !question.side_m)
    throw CLI::RequiredError("--side-m (the nominal side of the square that was driven)");
  finish_calibration(answer_umbmark(question, nominal), options.output, options.common);
}

}  // namespace

void add_umbmark(CLI::App& app) {
  auto options = std::make_shared<UmbmarkArguments>();
  CLI::App* command =
      add_command(app, "umbmark", "Calibrate from squares driven both ways, measured by hand or recorded",
                  "trundle umbmark sheet.csv --robot nominal.toml -o calibrated.toml", options->common);
  command
      ->add_option("SHEET", options->question.inputs,
                   "A sheet (CSV), or recording folders of single square runs")
      ->required();
  command->add_option("--robot", options->robot, "Nominal robot file")->required();
  command
      ->add_option("--side-m", options->question.side_m,
                   "Nominal side of the square [m]; a sheet may say it itself")
      ->check(number_from(kSmallest, kLargest));
  command
      ->add_option("--method", options->method,
                   "classic: positions; orientation: headings and the leg; ml: everything at once")
      ->check(CLI::IsMember({"classic", "orientation", "ml"}))
      ->capture_default_str();
  add_calibration_output(*command, options->output);
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
