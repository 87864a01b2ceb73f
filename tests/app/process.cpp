#include "app/process.hpp"

#include <csignal>
#include <cstdlib>
#include <thread>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "trundle/io/file.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

void read_from(const std::filesystem::path& file) {
  dup2(open(file.c_str(), O_RDONLY), STDIN_FILENO);
}

void redirect(int stream, const std::filesystem::path& file) {
  const int opened = open(file.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
  dup2(opened, stream);
}

void limit_memory(std::size_t bytes) {
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
}

[[noreturn]] void become_program(const std::filesystem::path& folder, const Arguments& arguments,
                                 const Circumstances& circumstances) {
  std::vector<char*> argv = {const_cast<char*>("trundle")};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  if (!circumstances.input.empty()) read_from(folder / circumstances.input);
  redirect(STDOUT_FILENO, folder / ".stdout");
  redirect(STDERR_FILENO, folder / ".stderr");
  for (const int stream : circumstances.closed) close(stream);
  if (circumstances.memory_bytes) limit_memory(*circumstances.memory_bytes);
  if (chdir(folder.c_str()) == 0) execv(circumstances.program.c_str(), argv.data());
  _exit(127);
}

}  // namespace

Outcome run_program(const std::filesystem::path& folder, const Arguments& arguments,
                    const Circumstances& circumstances) {
  const pid_t child = fork();
  if (child == 0) become_program(folder, arguments, circumstances);
  if (circumstances.ended_after) {
    std::this_thread::sleep_for(*circumstances.ended_after);
    kill(child, circumstances.signal);
  }
  int status = 0;
  rusage used{};
  wait4(child, &status, 0, &used);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_file(folder / ".stdout"),
          read_file(folder / ".stderr"), static_cast<std::size_t>(used.ru_maxrss) * 1024};
}

Outcome run_program(const std::filesystem::path& folder, const Arguments& arguments,
                    std::optional<std::chrono::microseconds> killed_after) {
  return run_program(folder, arguments, Circumstances{.ended_after = killed_after});
}

}  // namespace trundle::test
