#include "tools/page/numbers.h"

#include <algorithm>
#include <cmath>

#include "server/rounded.h"
#include "server/rpc.h"

namespace emtb::page {

json number(double value) { return std::isfinite(value) ? json(rounded(value)) : json(nullptr); }

json numbers(std::span<const double> values) {
  json list = json::array();
  for (const double value : values) list.push_back(number(value));
  return list;
}

Window Window::of(const json& params, double duration) {
  const rpc::Params checked(params);
  Window window;
  window.from = checked.number_or("from", 0, -1e9, 1e9);
  window.to = checked.number_or("to", duration, -1e9, 1e9);
  window.points = static_cast<std::size_t>(checked.number_or("points", 900, 10, 10000));
  return window;
}

Bins bins_of(std::span<const double> t, const Window& window) {
  Bins bins;
  const auto begin = static_cast<std::size_t>(std::ranges::lower_bound(t, window.from) - t.begin());
  const auto end = static_cast<std::size_t>(std::ranges::upper_bound(t, window.to) - t.begin());
  if (end <= begin) return bins;
  bins.single = end - begin <= window.points;
  if (bins.single) {
    for (std::size_t i = begin; i < end; ++i) {
      bins.t.push_back(t[i]);
      bins.first.push_back(i);
      bins.last.push_back(i + 1);
    }
    return bins;
  }
  const double width = (window.to - window.from) / static_cast<double>(window.points);
  for (std::size_t i = begin; i < end;) {
    const double bin = std::floor((t[i] - window.from) / width);
    std::size_t last = i + 1;
    while (last < end && std::floor((t[last] - window.from) / width) <= bin) ++last;
    bins.t.push_back(window.from + (bin + 0.5) * width);
    bins.first.push_back(i);
    bins.last.push_back(last);
    i = last;
  }
  return bins;
}

namespace {

template <class Of>
json each(const Bins& bins, std::span<const double> values, const Of& of) {
  json list = json::array();
  for (std::size_t b = 0; b < bins.t.size(); ++b) {
    list.push_back(number(of(values.subspan(bins.first[b], bins.last[b] - bins.first[b]))));
  }
  return list;
}

}  // namespace

json least(const Bins& bins, std::span<const double> values) {
  return each(bins, values, [](std::span<const double> v) { return std::ranges::min(v); });
}

json largest(const Bins& bins, std::span<const double> values) {
  return each(bins, values, [](std::span<const double> v) { return std::ranges::max(v); });
}

json mean(const Bins& bins, std::span<const double> values) {
  return each(bins, values, [](std::span<const double> v) {
    double sum = 0;
    for (const double value : v) sum += value;
    return sum / static_cast<double>(v.size());
  });
}

json binned(const Series& series, const Window& window) {
  const Bins bins = bins_of(series.t, window);
  if (bins.single) return {{"t", numbers(bins.t)}, {"value", least(bins, series.value)}};
  return {{"t", numbers(bins.t)}, {"min", least(bins, series.value)}, {"max", largest(bins, series.value)}};
}

json binned(const Run& run, const Window& window) {
  json signals = json::object();
  for (const auto& [signal, series] : run.signals) {
    json one = binned(series, window);
    one["unit"] = info(signal).unit;
    signals[std::string(info(signal).name)] = std::move(one);
  }
  return signals;
}

}  // namespace emtb::page
