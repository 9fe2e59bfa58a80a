#include "tools/command_line.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <new>

#include "hal/error.h"
#include "report/text.h"

namespace emtb {

struct Command::Impl {
  CLI::App* app = nullptr;
  std::unique_ptr<CLI::App> owned;  // the root
  std::function<int()> chosen{};    // of the root: the action of the command that was given
  std::shared_ptr<Impl> root{};     // of a command
};

Command& Command::argument(const std::string& name, std::string& value, const std::string& help) {
  impl_->app->add_option(name, value, help)->required();
  return *this;
}
Command& Command::optional_argument(const std::string& name, std::string& value, const std::string& help) {
  impl_->app->add_option(name, value, help);
  return *this;
}
Command& Command::arguments(const std::string& name, std::vector<std::string>& values, const std::string& help) {
  impl_->app->add_option(name, values, help)->required();
  return *this;
}
Command& Command::optional_arguments(const std::string& name, std::vector<std::string>& values,
                                     const std::string& help) {
  impl_->app->add_option(name, values, help);
  return *this;
}
Command& Command::hidden_option(const std::string& name, std::string& value, const std::string& help) {
  impl_->app->add_option(name, value, help)->group("");
  return *this;
}
Command& Command::option(const std::string& name, std::string& value, const std::string& help) {
  impl_->app->add_option(name, value, help);
  return *this;
}
Command& Command::option(const std::string& name, double& value, const std::string& help) {
  impl_->app->add_option(name, value, help)->capture_default_str();
  return *this;
}
Command& Command::option(const std::string& name, int& value, const std::string& help) {
  impl_->app->add_option(name, value, help)->capture_default_str();
  return *this;
}
Command& Command::options(const std::string& name, std::vector<std::string>& values, const std::string& help) {
  impl_->app->add_option(name, values, help);
  return *this;
}
Command& Command::flag(const std::string& name, bool& value, const std::string& help) {
  impl_->app->add_flag(name, value, help);
  return *this;
}

void Command::action(std::function<int()> run) {
  impl_->app->callback([root = std::weak_ptr(impl_->root), run = std::move(run)] {
    if (const auto to = root.lock()) to->chosen = run;  // run after parsing: its errors are not the parser's
  });
}

CommandLine::CommandLine(const std::string& description, const std::string& version)
    : impl_(std::make_shared<Command::Impl>()), global_(impl_) {
  impl_->owned = std::make_unique<CLI::App>(description, "emtb");
  impl_->app = impl_->owned.get();
  impl_->app->set_version_flag("--version", "emtb " + version);
  impl_->app->require_subcommand(1);
  impl_->app->fallthrough();
}

CommandLine::~CommandLine() = default;

Command CommandLine::command(const std::string& name, const std::string& help) {
  auto impl = std::make_shared<Command::Impl>();
  impl->app = impl_->app->add_subcommand(name, help);
  impl->root = impl_;
  return Command(std::move(impl));
}

int CommandLine::run(int argc, const char* const* argv) {
  try {
    impl_->app->parse(argc, argv);
    return impl_->chosen ? impl_->chosen() : 0;
  } catch (const CLI::Success& e) {  // --help, --version
    return impl_->app->exit(e);
  } catch (const CLI::ParseError& e) {
    const auto rest = impl_->app->remaining();
    const bool unknown = impl_->app->get_subcommands().empty() && !rest.empty();
    std::cerr << "emtb: " << (unknown ? printable(rest.front()) + ": no such command or option" : one_message(e.what()))
              << ". See emtb --help\n";
  } catch (const std::bad_alloc&) {
    std::cerr << "emtb: the memory that is free is not enough. Give fewer sessions, or spans of them: PATH@T0:T1\n";
  } catch (const std::exception& e) {
    std::cerr << "emtb: " << one_message(e.what()) << "\n";
  }
  return 2;
}

std::string as_called(int argc, const char* const* argv) {
  std::string command = "emtb";
  for (int i = 1; i < argc; ++i) command += " " + shell_quoted(argv[i]);
  return command;
}

}  // namespace emtb
