// trundle_manual FOLDER
// writes the program's man page and its completions, made from the options that the program itself declares:
// they cannot say something else than it.
#include <cstdio>
#include <filesystem>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

#include "commands.hpp"
#include "pages.hpp"

int main(int argc, char** argv) {
  using namespace trundle::app;
  if (argc != 2) {
    std::fputs("usage: trundle_manual FOLDER\n", stderr);
    return trundle::io::kUsage;
  }
  CLI::App app;
  add_commands(app);
  const Manual manual = manual_of(app);
  const std::filesystem::path folder = argv[1];
  trundle::io::write_file(folder / "trundle.1", man_page(manual));
  trundle::io::write_file(folder / "trundle.bash", bash_completion(manual));
  trundle::io::write_file(folder / "trundle.zsh", zsh_completion(manual));
  trundle::io::write_file(folder / "trundle.fish", fish_completion(manual));
}
