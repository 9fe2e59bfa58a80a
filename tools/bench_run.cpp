#include "tools/bench_run.h"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "hal/error.h"
#include "hal/signal.h"
#include "hal/unit.h"
#include "report/progress.h"
#include "report/text.h"

namespace emtb {
namespace {

using nlohmann::json;

volatile sig_atomic_t interrupt_seen = 0;

/// [s] How far the profile is; an older daemon does not say it.
double done(const json& run) { return run.value("done", run["t"].get<double>()); }

/// With one place after the point, also where that is 0: a time that runs does not jump in width.
std::string tenths(const json& value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value.get<double>());
  return text;
}

/// @return the number of the pause that waits, or 0
int tell_of_pause(const json& run, int told) {
  if (run.is_null() || run["pause"].is_null()) return 0;
  const int number = run["pause"]["number"];
  if (number == told) return told;
  std::cerr << "emtb: " << run["pause"]["say"].get<std::string>() << " (within "
            << pretty(run["pause"]["within"].get<double>()) << " s). Then "
            << (isatty(STDIN_FILENO) == 1 ? "press Enter, or " : "") << "`emtb confirm`" << std::endl;
  return number;
}

/// On a terminal only: a pipe's lines are meant for somebody else.
bool enter_pressed() {
  pollfd keys{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  if (isatty(STDIN_FILENO) != 1 || poll(&keys, 1, 0) <= 0) return false;
  std::string line;
  return static_cast<bool>(std::getline(std::cin, line));
}

}  // namespace

void catch_interrupt() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupt_seen = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // and no SA_RESTART: poll() shall return
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool motor_may_move(const std::string& question, bool yes) {
  return a_person_agrees(question, "whether the motor may move", yes);
}

bool a_person_agrees(const std::string& question, const std::string& about, bool yes) {
  std::cout << question << " [y/N] " << std::flush;
  if (yes) {
    std::cout << "yes (--yes)" << std::endl;
    return true;
  }
  if (isatty(STDIN_FILENO) != 1) {
    std::cout << std::endl;
    throw Error("nobody can be asked " + about + ": add --yes, or call it from a terminal");
  }
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

bool interrupted() { return interrupt_seen != 0; }

std::string signals_in_words(const json& signals) {
  std::string line;
  for (const Signal signal : all_signals()) {
    const auto found = signals.find(info(signal).name);
    if (found == signals.end()) continue;
    const json& value = found->is_object() ? (*found)["value"] : *found;
    line += (line.empty() ? "" : "  ") + std::string(info(signal).name) + " " +
            (value.is_number() ? pretty(value.get<double>()) : "-") + with_space(info(signal).unit);
  }
  return line;
}

std::string run_in_words(const json& run) {
  return run["profile"].get<std::string>() + " " + tenths(done(run)) + "/" + tenths(run["duration"]) + " s";
}

json run_on_bench(Client& daemon, const json& wish) {
  const json started = daemon.call("run", wish);
  Progress progress;
  bool stopping = false;
  int paused = 0;  // the pause that waits for us, from 1
  while (true) {
    if (interrupted() && !stopping) {
      stopping = true;
      stop_now(daemon.path());
    }
    if (paused != 0 && enter_pressed()) daemon.call("confirm", json::object());
    const auto message = daemon.notification(0.2);
    if (!message) continue;
    const json& now = (*message)["params"];
    if ((*message)["method"] == "live") paused = tell_of_pause(now["run"], paused);
    if ((*message)["method"] == "live" && !now["run"].is_null()) {
      progress.show(done(now["run"]) / now["run"]["duration"].get<double>(),
                    run_in_words(now["run"]) + "  " + signals_in_words(now["signals"]));
    }
    if ((*message)["method"] == "ended" && now["run"] == started["run"]) return now;
  }
}

std::string why_it_ended(const json& ended) {
  return ended["fault"].is_null() ? "stopped" : ended["fault"]["text"].get<std::string>();
}

}  // namespace emtb
