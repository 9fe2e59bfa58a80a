#include "tools/page/worker.h"

#include <unistd.h>

#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "config/model.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "server/rpc.h"
#include "tools/page/made_files.h"
#include "tools/page/recordings.h"

namespace emtb::page {
namespace {

/// Lines over a descriptor.
class Lines {
 public:
  bool next(std::string& line) {
    std::size_t end = 0;
    while ((end = input_.find('\n')) == std::string::npos) {
      std::array<char, 65536> chunk;
      const ssize_t n = read(WorkerProcess::channel, chunk.data(), chunk.size());
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return false;
      input_.append(chunk.data(), static_cast<std::size_t>(n));
    }
    line = input_.substr(0, end);
    input_.erase(0, end + 1);
    return true;
  }

  void say(char kind, std::string text) {
    text.insert(text.begin(), kind);
    text += '\n';
    for (std::size_t sent = 0; sent < text.size();) {
      const ssize_t n = write(WorkerProcess::channel, text.data() + sent, text.size() - sent);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) _exit(1);  // the page's server is gone
      sent += static_cast<std::size_t>(n);
    }
  }

 private:
  std::string input_;
};

class Worker {
 public:
  explicit Worker(const Files& files) : files_(files), recordings_(files) {}

  int run() {
    for (std::string line; lines_.next(line);) {
      const json request = json::parse(line, nullptr, false);
      if (!request.is_object()) return 1;
      const json id = request.value("id", json());
      std::string answer;
      try {
        answer = rpc::answer_result(id, answered(request.at("method"), request.at("params")));
      } catch (const rpc::Refusal& refusal) {
        answer = rpc::answer_error(id, refusal.code(), refusal.what());
      } catch (const Error& e) {
        answer = rpc::answer_error(id, rpc::code::not_available, e.what());
      } catch (const std::bad_alloc&) {
        answer =
            rpc::answer_error(id, rpc::code::internal_error, "the memory that a page may use is not enough for this");
      } catch (const std::exception& e) {
        answer = rpc::answer_error(id, rpc::code::internal_error, e.what());
      }
      lines_.say('A', std::move(answer));
    }
    return 0;
  }

 private:
  Work& work() {
    if (!work_) work_ = std::make_unique<Work>(files_);
    return *work_;
  }

  /// Something that changes the work: answered with its state, which the other pages are told.
  template <class Change>
  json changed(const Change& change) {
    change(work());
    json state = work().state();
    lines_.say('W', rpc::notification("work", state));
    return state;
  }

  Work::Progress progress(const std::string& what) {
    return
        [this, what, last = std::chrono::steady_clock::time_point()](double share, const std::string& doing) mutable {
          const auto now = std::chrono::steady_clock::now();
          if (now - last < std::chrono::milliseconds(100)) return;
          last = now;
          lines_.say('P', rpc::notification("progress", {{"what", what}, {"done", share}, {"of", 1}, {"text", doing}}));
        };
  }

  json add(const json& params) {
    return changed([&](Work& w) {
      if (params.contains("formula")) return w.add_formula(params["formula"]);
      w.add(w.model().effect_named(rpc::Params(params).text("effect")));
    });
  }

  /// Leaves the model fitted, which the other pages are told.
  json diagnose() {
    json answer = work().diagnose(progress("diagnose"));
    lines_.say('W', rpc::notification("work", answer["work"]));
    return answer;
  }

  json answered(const std::string& method, const json& params) {
    if (method == "simulate") return work().simulate(params);
    if (method == "work") return work().state();
    if (method == "set") return changed([&](Work& w) { w.set(params); });
    if (method == "lock") return changed([&](Work& w) { w.lock(params); });
    if (method == "fit") return changed([](Work& w) { w.fit(); });
    if (method == "add") return add(params);
    if (method == "remove") return changed([&](Work& w) { w.remove(rpc::Params(params).text("effect")); });
    if (method == "undo") return changed([](Work& w) { w.undo(); });
    if (method == "redo") return changed([](Work& w) { w.redo(); });
    if (method == "compare") return work().compare();
    if (method == "missing") return work().missing();
    if (method == "diagnose") return diagnose();
    if (method == "report") return work().report(progress(method));
    if (method == "formula") return work().score_formula(params);
    if (method == "export") return work().exported(params);
    if (method == "model_text") return {{"name", work().model().name}, {"text", to_yaml(work().model())}};
    if (method == "effect") return effect(rpc::Params(params).text("effect"));
    return of_recordings(method, params);
  }

  json of_recordings(const std::string& method, const json& params) {
    if (method == "sessions") return recordings_.list(files_.any() ? &work() : nullptr);
    if (method == "session_note") {
      recordings_.note(params);
      return json::object();
    }
    if (method == "session_use") {
      const rpc::Params checked(params);
      const std::string file = recordings_.checked(checked.text("path")).string();
      return changed([&](Work& w) { w.use(file, checked.text_or("as", "")); });
    }
    const auto mapping = [&] { return files_.any() ? work().mapping() : Mapping{}; };
    if (method == "session_data") return recordings_.data(params, mapping());
    if (method == "session_cut") return cut_session(params, files_, recordings_, mapping());
    if (method == "csv_columns") return csv_columns(params, recordings_);
    if (method == "csv_map") return map_csv(params, files_, recordings_);
    if (method == "profiles") return profile_names(files_.socket);
    if (method == "profile") return profile(params, files_.socket);
    if (method == "black_box") return black_box(params, files_.socket);
    throw rpc::Refusal(rpc::code::method_not_found, "no such method: " + method);
  }

  static json effect(const std::string& id) {
    const EffectInfo& e = effect_catalogue()[effect_index(id)];
    return {{"id", e.id},         {"name", e.name},      {"equation", e.equation},
            {"what", e.what},     {"shows", e.shows},    {"told_apart", e.told_apart},
            {"source", e.source}, {"needs", needs_of(e)}};
  }

  const Files files_;
  Recordings recordings_;
  std::unique_ptr<Work> work_;
  Lines lines_;
};

}  // namespace

std::vector<WorkMethod> work_methods() {
  constexpr double long_work = 7200;  // [s]
  std::vector<WorkMethod> all{{.name = "simulate", .newest = true, .limit = 60},
                              {.name = "diagnose", .changes = true, .abandoned = true, .limit = long_work},
                              {.name = "report", .abandoned = true, .limit = long_work}};
  for (const char* name : {"set", "lock", "fit", "add", "remove", "undo", "redo", "session_note", "session_use",
                           "session_cut", "csv_map"}) {
    all.push_back({.name = name, .changes = true, .limit = long_work});
  }
  for (const char* name : {"work", "compare", "missing", "formula", "export", "model_text", "effect", "sessions",
                           "session_data", "csv_columns", "profiles", "profile", "black_box"}) {
    all.push_back({.name = name});
  }
  return all;
}

int work_off(const Files& files) { return Worker(files).run(); }

}  // namespace emtb::page
