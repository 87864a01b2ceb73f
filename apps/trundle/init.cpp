#include <algorithm>
#include <memory>

#include <fmt/format.h>

#include "trundle/pipeline/init_answer.hpp"

#include "command.hpp"
#include "shared_output.hpp"

namespace trundle::app {
namespace {

struct InitArguments {
  std::string log;
  std::string folder;
  std::string urdf;
  std::string controller;
  std::vector<std::string> message_folders;
  Common common;
};

std::string line_of(const DraftStream& stream) {
  std::string columns;
  for (const DraftColumn& column : stream.columns) columns += " " + column.column;
  return fmt::format("{}:{} from {}{}\n", stream.table, columns,
                     stream.topic.empty() ? stream.file : stream.topic,
                     stream.reason.empty() ? "" : fmt::format(" ({})", stream.reason));
}

std::string lines_of(const char* title, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += "  " + line + "\n";
  return text.empty() ? text : std::string(title) + "\n" + text;
}

/// What a person does now.
std::string next_step(const Draft& draft, const std::string& folder) {
  if (draft.streams.empty())
    return "next: name columns in recording.toml (docs/recording.md): nothing was recognised\n";
  const bool says_motion = std::ranges::any_of(draft.streams, [](const DraftStream& stream) {
    return stream.table == "wheels" || stream.table == "velocity";
  });
  if (!says_motion)
    return "next: nothing in the log says how the robot moved: name the columns of its wheels in "
           "recording.toml, if "
           "they are there by other names (trundle info --verbose lists all fields), or record them\n";
  return fmt::format("next: {1}trundle run {0} --robot {0}/robot.toml -o out\n", folder,
                     draft.to_fill_in.empty() ? "" : "fill that in, then ");
}

std::string text_of(const InitAnswer& answer, const InitArguments& options) {
  std::string text;
  for (const DraftStream& stream : answer.draft.streams) text += line_of(stream);
  if (!answer.draft.alternatives.empty())
    text += fmt::format("{} more, as comments in recording.toml\n", answer.draft.alternatives.size());
  text += lines_of("notes:", answer.draft.notes);
  text += lines_of("to fill in:", answer.draft.to_fill_in);
  for (const OutputFile& file : answer.files) text += fmt::format("wrote {}\n", file.path.string());
  return text + next_step(answer.draft, options.folder);
}

void run(const InitArguments& options) {
  const InitAnswer answer =
      answer_init({.log = options.log,
                   .folder = options.folder,
                   .urdf = options.urdf,
                   .controller = options.controller,
                   .message_folders = {options.message_folders.begin(), options.message_folders.end()}});
  write_files(answer.files, answer.provenance.inputs);
  print(options.common, document_of(answer), text_of(answer, options));
}

}  // namespace

void add_init(CLI::App& app) {
  auto options = std::make_shared<InitArguments>();
  CLI::App* command = add_command(
      app, "init", "Drafts robot.toml and recording.toml for a log as it is, and says what to fill in",
      "trundle init drive.bag --urdf robot.urdf -o mine", options->common);
  command->add_option("LOG", options->log, "Log of any known format, or a folder of CSV files")->required();
  command->add_option("--urdf", options->urdf, "URDF of the robot: where its wheels are, and how large");
  command->add_option("--controller", options->controller,
                      "Parameters of its diff_drive_controller or mecanum_drive_controller (YAML)");
  command->add_option("--msg-path", options->message_folders,
                      "Folder with .msg files of types that a log does not define; may be given again");
  command->add_option("-o,--output", options->folder, "Folder of the two drafts")->required();
  command->callback([options] { run(*options); });
}

}  // namespace trundle::app
