#include "tools/completion.h"

#include <CLI/CLI.hpp>
#include <sstream>

#include "hal/error.h"

namespace emtb {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) { return app.get_subcommands({}); }

/// `--held-out --map ...`; those that the help hides are left out.
std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  std::vector<const CLI::Option*> all;
  for (const CLI::Option* o : app.get_options()) {
    const bool help = app.get_parent() != nullptr && o == app.get_help_ptr();
    if (!help && !o->get_lnames().empty() && !o->get_group().empty()) all.push_back(o);
  }
  return all;
}

/// Text of a manual: a hyphen that can be copied, no line that begins a request.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) {
      out += std::string("\\&") + c;
    } else {
      out += c;
    }
  }
  return out;
}

void options_in_manual(std::ostream& out, const CLI::App& app) {
  for (const CLI::Option* o : options_of(app)) {
    out << ".TP\n.B " << escaped(o->get_name(false, true));
    if (o->get_expected_max() != 0) out << " \\fI" << (o->get_type_name() == "TEXT" ? "VALUE" : "NUMBER") << "\\fR";
    out << "\n" << escaped(o->get_description()) << "\n";
  }
}

std::string manual(const CLI::App& app) {
  std::ostringstream out;
  out << ".TH emtb 1 \"\" \"emtb\" \"emtb\"\n.SH NAME\nemtb \\- DC\\-motor test bench, and what the model of the motor "
         "is "
         "missing\n.SH SYNOPSIS\n.B emtb\n[\\fIOPTIONS\\fR] \\fICOMMAND\\fR ...\n.SH DESCRIPTION\n"
      << escaped(app.get_description()) << "\n.SH OPTIONS\n";
  options_in_manual(out, app);
  out << ".SH COMMANDS\n";
  for (const CLI::App* command : commands_of(app)) {
    out << ".SS emtb " << escaped(command->get_name());
    for (const CLI::Option* o : command->get_options()) {
      if (o->get_positional()) out << " " << escaped(o->get_name(true, false));
    }
    out << "\n" << escaped(command->get_description()) << "\n";
    options_in_manual(out, *command);
  }
  out << ".SH EXIT STATUS\n0: done. 1: the answer is no. 2: bad use or input, with one line that says what, where, and "
         "what would be right.\n.SH SEE ALSO\n.BR emtbd (8),\n.BR emtb\\-safe (8),\n.BR emtb\\-plant (8),\n"
         "/usr/share/doc/emtb\n";
  return out.str();
}

std::string in_a_row(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::string names_of_commands(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : commands_of(app)) names.push_back(command->get_name());
  return in_a_row(names);
}

std::string names_of_options(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* o : options_of(app)) names.push_back("--" + o->get_lnames().front());
  return in_a_row(names);
}

/// The words that are arguments, in their order: MODEL, then SESSION.
std::vector<const CLI::Option*> arguments_of(const CLI::App& app) {
  std::vector<const CLI::Option*> all;
  for (const CLI::Option* o : app.get_options()) {
    if (o->get_positional()) all.push_back(o);
  }
  return all;
}

bool takes_many(const CLI::Option& o) { return o.get_expected_max() > 1; }
bool takes_a_number(const CLI::Option& o) { return o.get_type_name() == "FLOAT" || o.get_type_name() == "INT"; }

/// What may stand for an option's value or an argument: the words, and whether files.
Choice choice_of(const CLI::Option& o, const Choices& choices) {
  if (const auto known = choices.find(&o); known != choices.end()) return known->second;
  return {.words = [] { return std::vector<std::string>(); }, .files = !takes_a_number(o)};
}

/// One case of `_emtb_at`.
void bash_case(std::ostream& out, const std::string& pattern, const CLI::Option& o, const Choices& choices) {
  constexpr const char* any_number = "99";
  const Choice choice = choice_of(o, choices);
  const std::string words = in_a_row(choice.words());
  out << "    " << pattern << ")";
  if (!o.get_positional()) out << " values=" << (takes_many(o) ? any_number : o.get_expected_max() == 0 ? "0" : "1");
  if (!words.empty()) out << " words='" << words << "'";
  out << " files=" << (choice.files ? "yes" : "") << " ;;\n";
}

void bash_cases(std::ostream& out, const CLI::App& command, const Choices& choices) {
  const std::string name = command.get_name();
  for (const CLI::Option* o : options_of(command))
    bash_case(out, "'" + name + " --" + o->get_lnames().front() + "'", *o, choices);
  const std::vector<const CLI::Option*> arguments = arguments_of(command);
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const bool goes_on = i + 1 == arguments.size() && takes_many(*arguments[i]);
    bash_case(out, goes_on ? "'" + name + " @'*" : "'" + name + " @" + std::to_string(i + 1) + "'", *arguments[i],
              choices);
  }
  out << "    '" << name << " @'*) files= ;;\n    '" << name << " -') words='" << names_of_options(command)
      << "' files= ;;\n";
}

std::string for_bash(const CLI::App& app, const Choices& choices) {
  std::ostringstream out;
  out << R"(# bash completion of emtb, written by: emtb help --as bash

# What may stand behind a command's option, or as its argument: _emtb_at COMMAND --OPTION, _emtb_at COMMAND @2; its options:
# _emtb_at COMMAND -. Sets words, files (whether those may as well) and values, how many an option takes.
_emtb_at() {
  values=0 words= files=yes
  case "$1 $2" in
)";
  for (const CLI::App* command : commands_of(app)) bash_cases(out, *command, choices);
  for (const CLI::Option* o : options_of(app)) bash_case(out, "*' --" + o->get_lnames().front() + "'", *o, choices);
  out << "    ' @'*|' -') words='" << names_of_commands(app) << " " << names_of_options(app) << "' files= ;;\n";
  out << R"(  esac
}

_emtb() {
  local current=${COMP_WORDS[COMP_CWORD]} command= option= place=1 left=0 before= word values words files
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    if [[ $word == '=' ]]; then continue; fi  # of --OPTION=VALUE
    if [[ $word == -?* ]]; then
      option=$word
      _emtb_at "$command" "$option"
      left=$values
    elif ((left > 0)); then
      left=$((left - 1))
    elif [[ -z $command ]]; then
      command=$word
    else
      place=$((place + 1))
    fi
  done
  if [[ $current == '=' ]]; then current=; fi
  if [[ $current == -* ]]; then
    _emtb_at "$command" -
  elif ((left > 0)); then
    _emtb_at "$command" "$option"
    if [[ $values != 1 && -z $files && $current == *,* ]]; then before=${current%,*}, current=${current##*,}; fi
  else
    _emtb_at "$command" "@$place"
  fi
  COMPREPLY=()
  while IFS= read -r word; do COMPREPLY+=("$word"); done < <(
    compgen -P "$before" -W "$words" -- "$current"
    if [[ $files ]]; then compgen -f -- "$current"; fi
  )
  if [[ $files ]]; then compopt -o filenames 2>/dev/null || true; fi
}
complete -F _emtb emtb
)";
  return out.str();
}

/// Inside single quotes of zsh's `name[description]`.
std::string described(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else if (c == '[' || c == ']' || c == ':' || c == '\\') {
      out += std::string("\\") + c;
    } else {
      out += c;
    }
  }
  return out;
}

/// What zsh does where an option's value or an argument stands.
std::string zsh_action(const CLI::Option& o, const Choices& choices) {
  const Choice choice = choice_of(o, choices);
  const std::string words = in_a_row(choice.words());
  if (words.empty()) return choice.files ? "_files" : " ";
  if (choice.files) return "{compadd -- " + words + "; _files}";
  return takes_many(o) && !choice.only ? "_sequence compadd - " + words : "(" + words + ")";
}

void zsh_command(std::ostream& out, const CLI::App& command, const Choices& choices) {
  out << "      " << command.get_name() << ") _arguments";
  for (const CLI::Option* o : options_of(command)) {
    out << " \\\n          '" << (takes_many(*o) ? "*" : "") << "--" << o->get_lnames().front() << "["
        << described(o->get_description()) << "]";
    if (o->get_expected_max() != 0) out << ":value:" << zsh_action(*o, choices);
    out << "'";
  }
  const std::vector<const CLI::Option*> arguments = arguments_of(command);
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const bool goes_on = i + 1 == arguments.size() && takes_many(*arguments[i]);
    out << " \\\n          '" << (goes_on ? "*" : std::to_string(i + 1)) << ":"
        << described(arguments[i]->get_name(true, false)) << ":" << zsh_action(*arguments[i], choices) << "'";
  }
  out << " ;;\n";
}

std::string for_zsh(const CLI::App& app, const Choices& choices) {
  std::ostringstream out;
  out << "#compdef emtb\n# zsh completion of emtb, written by: emtb help --as zsh\n_emtb() {\n"
         "  local context state state_descr line\n  typeset -A opt_args\n  local -a commands\n  commands=(\n";
  for (const CLI::App* command : commands_of(app)) {
    out << "    '" << command->get_name() << ":" << described(command->get_description()) << "'\n";
  }
  out << "  )\n  _arguments -C";
  for (const CLI::Option* o : options_of(app)) {
    out << " \\\n      '--" << o->get_lnames().front() << "[" << described(o->get_description()) << "]"
        << (o->get_expected_max() != 0 ? ":value:" + zsh_action(*o, choices) : "") << "'";
  }
  out << " \\\n      '1: :->command' '*:: :->words'\n  case $state in\n"
         "    command) _describe command commands ;;\n    words)\n      case $words[1] in\n";
  for (const CLI::App* command : commands_of(app)) zsh_command(out, *command, choices);
  out << "      esac ;;\n  esac\n}\n_emtb \"$@\"\n";
  return out.str();
}

}  // namespace

std::string written_as(const std::string& kind, const CLI::App& app, const Choices& choices) {
  if (kind == "man") return manual(app);
  if (kind == "bash") return for_bash(app, choices);
  if (kind == "zsh") return for_zsh(app, choices);
  throw Error("--as " + kind + ": not known. Known: man, bash, zsh");
}

}  // namespace emtb
