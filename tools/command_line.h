#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class Option;
}

namespace emtb {

/// Words that are asked for when somebody wants to see them.
using Words = std::function<std::vector<std::string>()>;

/// One command of `emtb`: what it is called with, and what it does.
///
/// A thin cover over the parser (CLI11), which takes seconds to compile: only command_line.cpp sees it. What is bound
/// by reference must live until the command has run: keep it in a struct held by std::shared_ptr, which the action
/// captures.
class Command {
 public:
  struct Impl;
  explicit Command(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

  /// Names in help stand for what they are: `MODEL`, `SESSION`.
  Command& argument(const std::string& name, std::string& value, const std::string& help);  ///< must be given
  Command& optional_argument(const std::string& name, std::string& value, const std::string& help);
  Command& arguments(const std::string& name, std::vector<std::string>& values,
                     const std::string& help);  ///< one or more
  Command& optional_arguments(const std::string& name, std::vector<std::string>& values, const std::string& help);
  Command& option(const std::string& name, std::string& value, const std::string& help);         ///< `--note`
  Command& hidden_option(const std::string& name, std::string& value, const std::string& help);  ///< not in the help
  Command& option(const std::string& name, double& value, const std::string& help);
  Command& option(const std::string& name, int& value, const std::string& help);
  Command& options(const std::string& name, std::vector<std::string>& values,
                   const std::string& help);  ///< one or more
  Command& flag(const std::string& name, bool& value, const std::string& help);

  /// Of what was added last: the words that it may be. Another is refused with those that there are.
  Command& one_of(const std::vector<std::string>& words);
  /// Of what was added last: the words that a shell offers for it; others are taken as well.
  Command& offers(const Words& words);
  Command& offers_beside_files(const Words& words);

  /// What the command does. @return the exit code: 0 done, 1 the answer is no; bad use and input are thrown as Error
  /// (2).
  void action(std::function<int()> run);

 private:
  Command& added(CLI::Option* option);

  std::shared_ptr<Impl> impl_;
};

/// The command line of `emtb`; `help` is there from the start.
class CommandLine {
 public:
  CommandLine(const std::string& description, const std::string& version);
  ~CommandLine();

  /// What stands before the command, for all of them: `--socket`.
  Command& global() { return global_; }

  Command command(const std::string& name, const std::string& help);

  /// Puts commands that were added under a heading of the help, in the order of the calls. One that stands under none
  /// is not shown.
  void group(const std::string& heading, const std::vector<std::string>& commands);

  /// Parses and runs. @return the exit code; bad use is one line on stderr and 2, and so is an answer that standard
  /// output did not take.
  int run(int argc, const char* const* argv);

 private:
  int parse_and_run(int argc, const char* const* argv);

  std::shared_ptr<Command::Impl> impl_;
  Command global_;
};

/// The command line as somebody would type it again.
std::string as_called(int argc, const char* const* argv);

}  // namespace emtb
