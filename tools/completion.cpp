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

std::string for_bash(const CLI::App& app) {
  std::ostringstream out;
  out << "# bash completion of emtb, written by: emtb help --as bash\n_emtb() {\n"
         "  local word command= words= current=${COMP_WORDS[COMP_CWORD]}\n"
         "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
         "    if [[ $word != -* ]]; then command=$word; break; fi\n  done\n  case $command in\n    '') words='";
  for (const CLI::App* command : commands_of(app)) out << command->get_name() << " ";
  for (const CLI::Option* o : options_of(app)) out << "--" << o->get_lnames().front() << " ";
  out << "' ;;\n";
  std::string names;
  for (const CLI::App* command : commands_of(app)) {
    names += command->get_name() + " ";
    out << "    " << command->get_name() << ") words='";
    for (const CLI::Option* o : options_of(*command)) out << "--" << o->get_lnames().front() << " ";
    out << "' ;;\n";
  }
  out << "  esac\n  if [[ $command == help ]]; then words='" << names << "'; fi\n"
      << "  if [[ $current == -* || -z $command || $command == help ]]; then\n"
         "    COMPREPLY=($(compgen -W \"$words\" -- \"$current\"))\n  else\n"
         "    COMPREPLY=($(compgen -f -- \"$current\"))\n  fi\n}\ncomplete -o filenames -F _emtb emtb\n";
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

std::string for_zsh(const CLI::App& app) {
  std::ostringstream out;
  out << "#compdef emtb\n# zsh completion of emtb, written by: emtb help --as zsh\n_emtb() {\n  local -a commands\n"
         "  commands=(\n";
  for (const CLI::App* command : commands_of(app)) {
    out << "    '" << command->get_name() << ":" << described(command->get_description()) << "'\n";
  }
  out << "  )\n  if (( CURRENT == 2 )); then _describe command commands; return; fi\n  case $words[2] in\n"
         "    help) _describe command commands ;;\n";
  for (const CLI::App* command : commands_of(app)) {
    if (command->get_name() == "help") continue;
    out << "    " << command->get_name() << ") _arguments";
    for (const CLI::Option* o : options_of(*command)) {
      out << " \\\n      '--" << o->get_lnames().front() << "[" << described(o->get_description()) << "]"
          << (o->get_expected_max() != 0 ? ":value:_files" : "") << "'";
    }
    out << " \\\n      '*:file:_files' ;;\n";
  }
  out << "  esac\n}\n_emtb \"$@\"\n";
  return out.str();
}

}  // namespace

std::string written_as(const std::string& kind, const CLI::App& app) {
  if (kind == "man") return manual(app);
  if (kind == "bash") return for_bash(app);
  if (kind == "zsh") return for_zsh(app);
  throw Error("--as " + kind + ": not known. Known: man, bash, zsh");
}

}  // namespace emtb
