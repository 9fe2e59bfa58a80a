#include "server/work_queue.h"

#include <algorithm>
#include <chrono>

#include "hal/error.h"
#include "server/rpc.h"

namespace emtb {

using nlohmann::json;

WorkQueue::WorkQueue(boost::asio::io_context& context, std::vector<std::string> worker, std::vector<WorkMethod> methods,
                     Listeners listeners)
    : methods_(std::move(methods)),
      listeners_(std::move(listeners)),
      worker_(context, std::move(worker),
              {.line = [this](std::string line) { said(std::move(line)); },
               .ended =
                   [this](const std::string& how) {
                     const std::string why = "The process that computes for this page ended: " + how +
                                             ". It is started anew; the work is as it was before.";
                     listeners_.tell_all({}, rpc::notification("worker_died", {{"text", why}}));
                     end(rpc::code::internal_error, why);
                   }}),
      limit_(context) {}

const WorkMethod* WorkQueue::find(std::string_view method) const {
  const auto found = std::ranges::find(methods_, method, &WorkMethod::name);
  return found == methods_.end() ? nullptr : &*found;
}

void WorkQueue::fail(const Job& job, int code, const std::string& why) {
  listeners_.tell(job.client, rpc::answer_error(job.id, code, why));
}

void WorkQueue::submit(std::uint64_t client, const WorkMethod& method, json id, json params) {
  Job job{client, &method, std::move(id), std::move(params)};
  if (method.newest) {
    const auto older =
        std::ranges::find_if(waiting_, [&](const Job& j) { return j.client == client && j.method == &method; });
    if (older != waiting_.end()) {
      fail(*older, rpc::code::superseded, "a newer one came");
      waiting_.erase(older);
    }
  }
  if (std::ranges::count(waiting_, client, &Job::client) >= static_cast<std::ptrdiff_t>(most_waiting)) {
    return fail(job, rpc::code::invalid_request, "too much is asked at once: wait for answers");
  }
  if (method.newest) {
    waiting_.push_front(std::move(job));
  } else {
    waiting_.push_back(std::move(job));
  }
  next();
}

void WorkQueue::next() {
  while (!on_ && !waiting_.empty()) {
    on_ = std::move(waiting_.front());
    waiting_.pop_front();
    try {
      worker_.send(json{{"id", on_->id}, {"method", on_->method->name}, {"params", on_->params}}.dump(
          -1, ' ', false, json::error_handler_t::replace));
    } catch (const Error& e) {
      fail(*on_, rpc::code::internal_error, e.what());
      on_.reset();
      continue;
    }
    limit_.expires_after(std::chrono::milliseconds(static_cast<std::int64_t>(on_->method->limit * 1e3)));
    limit_.async_wait([this](const boost::system::error_code& error) {
      if (error || !on_) return;
      const std::string why = on_->method->name + " took longer than it may and was ended";
      worker_.stop();
      end(rpc::code::internal_error, why);
    });
  }
}

void WorkQueue::said(std::string line) {
  if (line.empty()) return;
  const char kind = line.front();
  line.erase(0, 1);
  if (kind == 'W') {
    listeners_.tell_all(on_ ? std::optional(on_->client) : std::nullopt, line);
  } else if (on_ && kind == 'P') {
    listeners_.tell(on_->client, std::move(line));
  } else if (on_ && kind == 'A') {
    const std::uint64_t client = on_->client;
    limit_.cancel();
    on_.reset();
    listeners_.tell(client, std::move(line));
    next();
  }
}

void WorkQueue::end(int code, const std::string& why) {
  limit_.cancel();
  if (const auto job = std::exchange(on_, std::nullopt)) fail(*job, code, why);
  next();
}

json WorkQueue::cancel() {
  if (!on_) return nullptr;
  const std::string method = on_->method->name;
  worker_.stop();
  end(rpc::code::superseded, "cancelled");
  return method;
}

void WorkQueue::forget(std::uint64_t client) {
  std::erase_if(waiting_, [client](const Job& job) { return job.client == client; });
  if (on_ && on_->client == client && on_->method->abandoned) cancel();
}

void WorkQueue::stop() {
  waiting_.clear();
  on_.reset();
  limit_.cancel();
  worker_.stop();
}

}  // namespace emtb
