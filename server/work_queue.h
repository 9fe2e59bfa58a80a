#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <deque>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/worker_process.h"

namespace emtb {

/// A method that the worker process answers.
struct WorkMethod {
  std::string name;
  bool changes = false;    ///< something that others see: refused to who may only look
  bool newest = false;     ///< goes first, and a newer one of the same client takes the place of one that waits
  bool abandoned = false;  ///< of no use once who asked is gone
  double limit = 600;      ///< [s] after which it is ended
};

/// What pages ask of the worker, one after the other.
///
/// The worker is sent `{"id", "method", "params"}` and says lines that begin with a letter: `A` and the whole answer;
/// `P` and a notification for who asked; `W` and one for all others.
class WorkQueue {
 public:
  static constexpr std::size_t most_waiting = 32;  ///< of one client

  struct Listeners {
    std::function<void(std::uint64_t client, std::string text)> tell;
    std::function<void(std::optional<std::uint64_t> but, const std::string& text)> tell_all;
  };

  WorkQueue(boost::asio::io_context& context, std::vector<std::string> worker, std::vector<WorkMethod> methods,
            Listeners listeners);

  const WorkMethod* find(std::string_view method) const;
  void submit(std::uint64_t client, const WorkMethod& method, nlohmann::json id, nlohmann::json params);

  /// Ends what is on. @return its method, or null
  nlohmann::json cancel();
  void forget(std::uint64_t client);
  void stop();

 private:
  struct Job {
    std::uint64_t client = 0;
    const WorkMethod* method = nullptr;
    nlohmann::json id, params;
  };

  void next();
  void said(std::string line);
  void fail(const Job& job, int code, const std::string& why);
  void end(int code, const std::string& why);

  const std::vector<WorkMethod> methods_;
  const Listeners listeners_;
  WorkerProcess worker_;
  boost::asio::steady_timer limit_;
  std::deque<Job> waiting_;
  std::optional<Job> on_;
};

}  // namespace emtb
