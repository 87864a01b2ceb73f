#include "app/process.hpp"

#include <csignal>
#include <cstdlib>
#include <thread>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "trundle/io/file.hpp"

namespace trundle::test {
namespace {

void redirect(int stream, const std::filesystem::path& file) {
  const int opened = open(file.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
  dup2(opened, stream);
}

[[noreturn]] void become_program(const std::filesystem::path& folder, const Arguments& arguments) {
  std::vector<char*> argv = {const_cast<char*>("trundle")};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  redirect(STDOUT_FILENO, folder / ".stdout");
  redirect(STDERR_FILENO, folder / ".stderr");
  if (chdir(folder.c_str()) == 0) execv(TRUNDLE_PROGRAM, argv.data());
  _exit(127);
}

}  // namespace

Outcome run_program(const std::filesystem::path& folder, const Arguments& arguments,
                    std::optional<std::chrono::microseconds> killed_after) {
  const pid_t child = fork();
  if (child == 0) become_program(folder, arguments);
  if (killed_after) {
    std::this_thread::sleep_for(*killed_after);
    kill(child, SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(folder / ".stdout"),
          read_file(folder / ".stderr")};
}

}  // namespace trundle::test
