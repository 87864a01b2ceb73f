#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "trundle/pipeline/drafting/draft.hpp"
#include "trundle/pipeline/files.hpp"
#include "trundle/pipeline/provenance.hpp"

namespace trundle::pipeline {

/// What `trundle init` is asked.
struct InitQuestion {
  std::filesystem::path log;     ///< or a folder of CSV files
  std::filesystem::path folder;  ///< of the two drafts
  std::string urdf = {};         ///< empty: none
  std::string controller = {};
  std::vector<std::filesystem::path> message_folders = {};  ///< as LogQuestion
};
struct InitAnswer {
  Provenance provenance;
  Draft draft;
  std::vector<OutputFile> files;  ///< robot.toml, recording.toml
};

/// Throws InputError where it is neither a log nor a folder of CSV files, or the folder has files of these
/// names already that say something else: what a person wrote is not lost.
[[nodiscard]] InitAnswer answer_init(const InitQuestion& question);

/// What `trundle init --json` prints.
[[nodiscard]] nlohmann::ordered_json document_of(const InitAnswer& answer);

}  // namespace trundle::pipeline
