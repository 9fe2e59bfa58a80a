#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>

#include "emtb/version.h"
#include "hal/error.h"
#include "server/client.h"
#include "server/page_checks.h"
#include "server/page_server.h"
#include "tools/commands.h"
#include "tools/page/worker.h"
#include "tools/user_folder.h"
#include "web/assets.h"

namespace emtb {
namespace {

struct PageOptions {
  std::shared_ptr<const std::string> socket;
  std::vector<std::string> files, held_out;  // MODEL SESSION...
  std::string map, listen, web, worker;
  int port = 8088;
  std::string command;
};

/// $XDG_STATE_HOME/emtb, else ~/.local/state/emtb.
std::filesystem::path state_folder() {
  std::filesystem::path folder = user_folder("XDG_STATE_HOME", ".local/state");
  if (folder.empty()) throw Error("no place to keep the work: neither XDG_STATE_HOME nor HOME is set");
  return folder;
}

std::vector<std::string> absolute(const std::vector<std::string>& specs) {
  std::vector<std::string> all;
  for (const std::string& spec : specs) all.push_back(std::filesystem::absolute(spec).lexically_normal().string());
  return all;
}

page::Files files_of(const PageOptions& o) {
  page::Files files{.model = o.files.empty() ? "" : std::filesystem::absolute(o.files.front()).string(),
                    .map = o.map.empty() ? "" : std::filesystem::absolute(o.map).string(),
                    .sessions = {},
                    .held_out = absolute(o.held_out),
                    .state = state_folder(),
                    .socket = {},
                    .command = o.command};
  if (!o.files.empty()) files.sessions = absolute({o.files.begin() + 1, o.files.end()});
  return files;
}

/// Alone: the bench. With files: the bench, too, where its socket is.
std::filesystem::path bench_socket(const PageOptions& o) {
  const auto socket = socket_to_call(*o.socket);
  std::error_code ignored;
  if (o.files.empty() || !o.socket->empty() || std::filesystem::exists(socket, ignored)) return socket;
  return {};
}

std::optional<PageFile> file_below(const std::filesystem::path& folder, std::string_view path) {
  static const std::map<std::string_view, std::pair<const char*, const char*>> names{
      {"/", {"index.html", "text/html; charset=utf-8"}},
      {"/page.js", {"page.js", "text/javascript; charset=utf-8"}},
      {"/page.css", {"page.css", "text/css; charset=utf-8"}}};
  const auto found = names.find(path);
  if (found == names.end()) return {};
  std::ifstream in(folder / found->second.first, std::ios::binary);
  if (!in) return {};
  return PageFile{{std::istreambuf_iterator<char>(in), {}}, found->second.second};
}

/// The worker is this program once more.
std::vector<std::string> worker_words(const PageOptions& o, const page::Files& files) {
  std::vector<std::string> words{"emtb"};
  if (!files.socket.empty()) words.insert(words.end(), {"--socket", files.socket.string()});
  words.emplace_back("page");
  if (files.any()) words.push_back(files.model);
  words.insert(words.end(), files.sessions.begin(), files.sessions.end());
  if (!files.held_out.empty()) words.emplace_back("--held-out");
  words.insert(words.end(), files.held_out.begin(), files.held_out.end());
  if (!files.map.empty()) words.insert(words.end(), {"--map", files.map});
  words.insert(words.end(), {"--worker", files.socket.empty() ? "files" : "bench"});
  words.insert(words.end(), {"--as", o.command});
  return words;
}

int page_command(const PageOptions& o) {
  if (o.files.size() == 1) throw Error("page MODEL needs a SESSION behind the model: a .csv, .h5 or .mat");
  if (!o.held_out.empty() && o.files.empty()) throw Error("--held-out is of a MODEL and its SESSIONs: name them, too");
  page::Files files = files_of(o);
  if (!o.worker.empty()) {
    if (o.worker == "bench") files.socket = socket_to_call(*o.socket);
    return page::work_off(files);
  }
  for (const std::string& file : {files.model, files.map}) {
    if (!file.empty() && !std::filesystem::exists(file)) throw Error(file + ": no such file");
  }
  if (o.port < 0 || o.port > 65535) throw Error("--port must be 0 to 65535");
  files.socket = bench_socket(o);
  const std::string token = random_token();
  PageServer server({.port = static_cast<std::uint16_t>(o.port),
                     .listen = o.listen,
                     .token = token,
                     .version = version,
                     .socket = files.socket,
                     .files = files.any(),
                     .imports = files.imports(),
                     .worker = worker_words(o, files),
                     .methods = page::work_methods(),
                     .file = [&o](std::string_view path) -> std::optional<PageFile> {
                       if (!o.web.empty()) return file_below(o.web, path);
                       const auto asset = web_asset(path);
                       if (!asset) return {};
                       return PageFile{std::string(asset->bytes), std::string(asset->type)};
                     }});
  std::cout << "http://localhost:" << server.port() << "/#token=" << token << "\n"
            << (files.any()
                    ? "The work is kept in " + files.state.string() + "; " + o.files.front() + " is not changed.\n"
                    : "The bench at " + files.socket.string() + ".\n")
            << "Ctrl-C ends it.\n"
            << std::flush;
  server.run();
  return 0;
}

}  // namespace

void add_page_command(CommandLine& line, const std::shared_ptr<const std::string>& socket, int argc,
                      const char* const* argv) {
  const auto o = std::make_shared<PageOptions>();
  o->socket = socket;
  o->command = as_called(argc, argv);
  line.command("page", "serves the page on this computer: the bench live, and a model over recorded sessions")
      .optional_arguments("MODEL SESSION", o->files,
                          "the model's YAML, and the sessions that it is fitted to; none: the bench alone")
      .options("--held-out", o->held_out, "sessions that judge the fit and take no part in it")
      .option("--map", o->map, "how the columns of foreign CSV files become signals")
      .option("--port", o->port, "where it listens on 127.0.0.1 and ::1 [8088]; 0: any that is free")
      .option("--listen", o->listen, "one more address of this computer; who comes by it may look and stop, not move")
      .hidden_option("--web", o->web, "serves the page from this folder")
      .hidden_option("--worker", o->worker, "the process that computes for a page")
      .hidden_option("--as", o->command, "what a report says it was made by")
      .action([o] { return page_command(*o); });
}

}  // namespace emtb
