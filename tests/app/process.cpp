#include "app/process.hpp"

#include <array>
#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "trundle/io/file.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

/// A pipe so short that what was given to it has, but for a page, been taken out.
struct Pipe {
  Pipe() {
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    fcntl(ends[1], F_SETPIPE_SZ, 4096);
  }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  void close_end(std::size_t i) {
    if (ends[i] >= 0) close(std::exchange(ends[i], -1));
  }

  std::array<int, 2> ends{-1, -1};  // to read from, to write to
};

/// Waits until all is in the pipe.
void give(Pipe& pipe, std::string_view text) {
  pipe.close_end(0);              // the program alone reads
  std::signal(SIGPIPE, SIG_IGN);  // where it has ended before, write says so
  while (!text.empty()) {
    const ssize_t taken = write(pipe.ends[1], text.data(), text.size());
    if (taken < 0) throw std::runtime_error("nothing reads from the pipe");
    text.remove_prefix(static_cast<std::size_t>(taken));
  }
}

void read_from(const std::filesystem::path& file) {
  dup2(open(file.c_str(), O_RDONLY), STDIN_FILENO);
}

/// What the program says into one of its streams. The file is emptied before the program begins: one that is
/// killed at once must not seem to have said what was said before it.
class Transcript {
 public:
  explicit Transcript(std::filesystem::path file)
      : file_{std::move(file)}, opened_{open(file_.c_str(), O_CREAT | O_WRONLY | O_TRUNC | O_CLOEXEC, 0600)} {
    if (opened_ < 0) throw std::runtime_error("no file for what the program says");
  }
  ~Transcript() { close(opened_); }
  Transcript(const Transcript&) = delete;
  Transcript& operator=(const Transcript&) = delete;

  void takes(int stream) const { dup2(opened_, stream); }
  std::string text() const { return read_file(file_); }

 private:
  std::filesystem::path file_;
  int opened_;
};

void limit_memory(std::size_t bytes) {
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
}

[[noreturn]] void become_program(const std::filesystem::path& folder, const Arguments& arguments,
                                 const Circumstances& circumstances, const Pipe& pipe, const Transcript& out,
                                 const Transcript& err) {
  std::vector<char*> argv = {const_cast<char*>("trundle")};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  std::signal(SIGPIPE, SIG_DFL);
  if (circumstances.ended_after_input)
    dup2(pipe.ends[0], STDIN_FILENO);
  else if (!circumstances.input.empty())
    read_from(folder / circumstances.input);
  out.takes(STDOUT_FILENO);
  err.takes(STDERR_FILENO);
  for (const int stream : circumstances.closed) close(stream);
  if (circumstances.memory_bytes) limit_memory(*circumstances.memory_bytes);
  if (chdir(folder.c_str()) == 0) execv(circumstances.program.c_str(), argv.data());
  _exit(127);
}

}  // namespace

Outcome run_program(const std::filesystem::path& folder, const Arguments& arguments,
                    const Circumstances& circumstances) {
  Pipe pipe;
  const Transcript out{folder / ".stdout"}, err{folder / ".stderr"};
  const pid_t child = fork();
  if (child == 0) become_program(folder, arguments, circumstances, pipe, out, err);
  if (circumstances.ended_after_input) {
    give(pipe, read_file(folder / circumstances.input).substr(0, *circumstances.ended_after_input));
    kill(child, circumstances.signal);
  }
  if (circumstances.ended_after) {
    std::this_thread::sleep_for(*circumstances.ended_after);
    kill(child, circumstances.signal);
  }
  int status = 0;
  rusage used{};
  wait4(child, &status, 0, &used);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, out.text(), err.text(),
          static_cast<std::size_t>(used.ru_maxrss) * 1024};
}

Outcome run_program(const std::filesystem::path& folder, const Arguments& arguments,
                    std::optional<std::chrono::microseconds> killed_after) {
  return run_program(folder, arguments, Circumstances{.ended_after = killed_after});
}

}  // namespace trundle::test
