#include "tools/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <new>

#include "figures/terminal.h"
#include "hal/did_you_mean.h"
#include "hal/error.h"
#include "hal/one_line.h"
#include "hal/printable.h"
#include "report/text.h"
#include "tools/completion.h"

namespace emtb {
namespace {

/// Two columns: what is typed, and what it does, which goes on below itself where the line ends.
class HelpPage : public CLI::Formatter {
 public:
  struct Group {
    std::string heading;
    std::vector<std::string> commands;
  };
  std::vector<Group> groups;  ///< of commands, as they are shown

  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    std::string text = CLI::Formatter::make_help(app, std::move(name), mode);
    while (text.ends_with("\n\n")) text.pop_back();
    return text;
  }

  std::string make_description(const CLI::App* app) const override {
    const std::string text = app->get_description();
    return text.empty() ? "" : wrapped(text, width()) + "\n";
  }

  std::string make_option(const CLI::Option* option, bool positional) const override {
    return row(make_option_name(option, positional) + make_option_opts(option), make_option_desc(option), 26);
  }

  std::string make_subcommand(const CLI::App* command) const override {
    return row(command->get_name(), command->get_description(), 16);
  }

  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode) const override {
    std::string text;
    for (const auto& [heading, names] : groups) {
      if (app->get_parent() != nullptr) break;
      text += "\n" + heading + ":\n";
      for (const std::string& name : names) text += make_subcommand(app->get_subcommand(name));
    }
    return text;
  }

 private:
  static std::size_t width() { return std::min<std::size_t>(width_of_prose(), 120); }

  std::string row(const std::string& left, const std::string& right, std::size_t column) const {
    constexpr std::size_t gap = 2;
    const std::string head = "  " + left;
    const std::string body = wrapped(right, width(), column);
    if (right.empty()) return head + "\n";
    if (head.size() + gap > column) return head + "\n" + body + "\n";
    return head + body.substr(head.size()) + "\n";
  }
};

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

std::string no_such_command(const std::string& typed, const CLI::App& app) {
  const std::string guess = did_you_mean(typed, commands_of(app));
  return printable(typed) + ": no such command" + (guess.empty() ? ". See emtb --help" : guess);
}

/// `check, calibrate or spin`
std::string in_a_row(const std::vector<std::string>& words, const std::string& last) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) text += (i == 0 ? "" : i + 1 == words.size() ? last : ", ") + words[i];
  return text;
}

/// Where a command lacks a word of which there are but a few: which.
std::string missing_word(const CLI::App& command, const Choices& choices) {
  for (const CLI::Option* o : command.get_options()) {
    if (!o->get_positional() || !o->get_required() || !o->empty()) continue;
    const auto choice = choices.find(o);
    if (choice == choices.end() || !choice->second.only) break;
    return command.get_name() + ": which? " + in_a_row(choice->second.words(), " or ");
  }
  return "";
}

/// @throws Error where a word is none of those that there are
void refuse_unknown_words(const CLI::App& command, const Choices& choices) {
  for (const CLI::Option* o : command.get_options()) {
    const auto choice = choices.find(o);
    if (choice == choices.end() || !choice->second.only) continue;
    const std::vector<std::string> known = choice->second.words();
    for (const std::string& word : o->results()) {
      if (std::ranges::find(known, word) != known.end()) continue;
      const std::string what = o->get_positional() ? command.get_name() : "--" + o->get_lnames().front();
      const std::string guess = did_you_mean(word, known);
      throw Error(what + " " + printable(word) + ": not known" +
                  (guess.empty() ? ". Known: " + in_a_row(known, ", ") : guess));
    }
  }
}

/// What was typed that nothing takes: a command, or an option of the one that was given.
std::string not_understood(const CLI::App& app, const Choices& choices, const std::string& what) {
  const auto chosen = app.get_subcommands();
  const std::vector<std::string> rest = app.remaining(true);
  if (rest.empty() && chosen.empty()) return "which command? See emtb --help";
  if (rest.empty()) {
    const std::string missing = missing_word(*chosen.front(), choices);
    return (missing.empty() ? what : missing) + ". See emtb help " + chosen.front()->get_name();
  }
  if (chosen.empty() && !rest.front().starts_with("-")) return no_such_command(rest.front(), app);
  const CLI::App& owner = chosen.empty() ? app : *chosen.front();
  const auto option = std::ranges::find_if(rest, [](const std::string& word) { return word.starts_with("-"); });
  const std::string help = chosen.empty() ? "emtb --help" : "emtb help " + owner.get_name();
  if (option == rest.end()) return printable(rest.front()) + ": one word too many. See " + help;
  std::vector<std::string> known;
  for (const CLI::Option* o : owner.get_options()) {
    for (const std::string& name : o->get_lnames()) known.push_back("--" + name);
  }
  const std::string guess = did_you_mean(*option, known);
  return printable(*option) + ": no such option" + (guess.empty() ? "" : guess) + (guess.empty() ? ". See " : " See ") +
         help;
}

}  // namespace

struct Command::Impl {
  CLI::App* app = nullptr;
  std::unique_ptr<CLI::App> owned;   // the root
  std::function<int()> chosen{};     // of the root: the action of the command that was given
  std::shared_ptr<Impl> root{};      // of a command
  std::shared_ptr<HelpPage> page{};  // of the root
  Choices choices{};                 // of the root: those of all commands
  const CLI::Option* last = nullptr;

  void choose(Choice choice) { (root ? root->choices : choices)[last] = std::move(choice); }
};

Command& Command::added(CLI::Option* option) {
  impl_->last = option;
  return *this;
}
Command& Command::one_of(const std::vector<std::string>& words) {
  impl_->choose({.words = [words] { return words; }, .only = true});
  return *this;
}
Command& Command::offers(const Words& words) {
  impl_->choose({.words = words});
  return *this;
}
Command& Command::offers_beside_files(const Words& words) {
  impl_->choose({.words = words, .files = true});
  return *this;
}

Command& Command::argument(const std::string& name, std::string& value, const std::string& help) {
  return added(impl_->app->add_option(name, value, help)->required());
}
Command& Command::optional_argument(const std::string& name, std::string& value, const std::string& help) {
  return added(impl_->app->add_option(name, value, help));
}
Command& Command::arguments(const std::string& name, std::vector<std::string>& values, const std::string& help) {
  return added(impl_->app->add_option(name, values, help)->required());
}
Command& Command::optional_arguments(const std::string& name, std::vector<std::string>& values,
                                     const std::string& help) {
  return added(impl_->app->add_option(name, values, help));
}
Command& Command::hidden_option(const std::string& name, std::string& value, const std::string& help) {
  return added(impl_->app->add_option(name, value, help)->group(""));
}
Command& Command::option(const std::string& name, std::string& value, const std::string& help) {
  return added(impl_->app->add_option(name, value, help));
}
Command& Command::option(const std::string& name, double& value, const std::string& help) {
  return added(impl_->app->add_option(name, value, help)->capture_default_str());
}
Command& Command::option(const std::string& name, int& value, const std::string& help) {
  return added(impl_->app->add_option(name, value, help)->capture_default_str());
}
Command& Command::options(const std::string& name, std::vector<std::string>& values, const std::string& help) {
  return added(impl_->app->add_option(name, values, help));
}
Command& Command::flag(const std::string& name, bool& value, const std::string& help) {
  return added(impl_->app->add_flag(name, value, help));
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
  impl_->page = std::make_shared<HelpPage>();
  impl_->page->label("SUBCOMMAND", "COMMAND");
  impl_->app->formatter(impl_->page);
  impl_->app->get_help_ptr()->description("says what there is, and ends");
  impl_->app->get_option("--version")->description("says which emtb this is, and ends");
  struct Asked {
    std::string about, as;
  };
  const auto asked = std::make_shared<Asked>();
  Command help = command("help", "explains a command: all of its options");
  help.optional_argument("COMMAND", asked->about, "without it the list of all commands")
      .offers([root = std::weak_ptr(impl_)] { return commands_of(*root.lock()->app); });
  help.hidden_option("--as", asked->as, "man, bash or zsh: for the package");
  help.action([asked, root = std::weak_ptr(impl_)] {
    const CLI::App& app = *root.lock()->app;
    if (!asked->as.empty()) {
      std::cout << written_as(asked->as, app, root.lock()->choices);
      return 0;
    }
    const auto commands = app.get_subcommands([&](const CLI::App* c) { return c->get_name() == asked->about; });
    if (!asked->about.empty() && commands.empty()) throw Error(no_such_command(asked->about, app));
    const CLI::App& shown = commands.empty() ? app : *commands.front();
    const std::string name = commands.empty() ? "emtb" : "emtb " + asked->about;
    std::cout << app.get_formatter()->make_help(&shown, name, CLI::AppFormatMode::Normal);  // App::help() is of `help`
    return 0;
  });
}

CommandLine::~CommandLine() = default;

Command CommandLine::command(const std::string& name, const std::string& help) {
  auto impl = std::make_shared<Command::Impl>();
  impl->app = impl_->app->add_subcommand(name, help);
  impl->root = impl_;
  return Command(std::move(impl));
}

void CommandLine::group(const std::string& heading, const std::vector<std::string>& commands) {
  impl_->page->groups.push_back({heading, commands});
}

int CommandLine::run(int argc, const char* const* argv) {
  const int code = parse_and_run(argc, argv);
  // An answer that a full disk or a closed standard output swallowed is none.
  errno = 0;
  if (std::cout.flush() && std::fflush(stdout) == 0) return code;
  std::cerr << "emtb: standard output takes no more" << (errno != 0 ? std::string(": ") + std::strerror(errno) : "")
            << ". What was to be printed is not there in whole\n";
  return code != 0 ? code : 2;
}

int CommandLine::parse_and_run(int argc, const char* const* argv) {
  try {
    impl_->app->parse(argc, argv);
    for (const CLI::App* command : impl_->app->get_subcommands()) refuse_unknown_words(*command, impl_->choices);
    return impl_->chosen ? impl_->chosen() : 0;
  } catch (const CLI::Success& e) {  // --help, --version
    return impl_->app->exit(e);
  } catch (const CLI::ParseError& e) {
    std::cerr << "emtb: " << in_one_line(not_understood(*impl_->app, impl_->choices, e.what())) << "\n";
  } catch (const std::bad_alloc&) {
    std::cerr << "emtb: the memory that is free is not enough. Give fewer sessions, or spans of them: PATH@T0:T1\n";
  } catch (const std::exception& e) {
    std::cerr << "emtb: " << in_one_line(e.what()) << "\n";
  }
  return 2;
}

std::string as_called(int argc, const char* const* argv) {
  std::string command = "emtb";
  for (int i = 1; i < argc; ++i) command += " " + shell_quoted(argv[i]);
  return command;
}

}  // namespace emtb
