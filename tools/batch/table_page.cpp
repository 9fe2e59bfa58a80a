#include <cmath>
#include <ctime>
#include <limits>

#include "report/page.h"
#include "report/symbols.h"
#include "report/text.h"
#include "tools/batch/table.h"

namespace emtb {
namespace {

constexpr std::size_t longest_list = 1000;  // rows of a table that a browser still shows at once

/// [s] since 1970 of an ISO 8601 time; no number where it is none.
double seconds_of(const std::string& time) {
  std::tm t{};
  const char* end = strptime(time.c_str(), "%Y-%m-%d", &t);
  if (end == nullptr) return std::numeric_limits<double>::quiet_NaN();
  if (*end == 'T' || *end == ' ') {
    const char* clock = strptime(end + 1, "%H:%M:%S", &t);
    if (clock == nullptr) strptime(end + 1, "%H:%M", &t);
  }
  return static_cast<double>(timegm(&t));
}

/// What is drawn over an axis: values with their errors, those that pass and those that do not.
struct Points {
  std::vector<double> x, y, low, high;

  void add(double at, double value, double error) {
    x.push_back(at);
    y.push_back(value);
    low.push_back(value - error);
    high.push_back(value + error);
  }
};

/// One quantity over all motors. @param at the place of each row on the axis
Figure over(const BatchTable& table, const std::vector<double>& at, const Axis& axis, const std::string& name,
            const std::string& unit) {
  Points pass, fail;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const BatchRow& row = table.rows[i];
    const BatchRow::Value* v = row.find(name);
    const std::optional<double> value = name == "error" ? row.error()
                                        : v != nullptr  ? std::optional(v->value)
                                                        : std::nullopt;
    if (!value || !std::isfinite(at[i])) continue;
    (row.passes ? pass : fail).add(at[i], *value, v != nullptr ? v->std_error.value_or(0) : 0);
  }
  Figure figure("", name + " of each motor, with its standard error");
  figure.x(axis);
  Panel& panel = figure.panel({name == "error" ? name : symbol_of(name), printed_unit(unit)});
  if (!pass.x.empty()) panel.points_with_errors("pass", pass.x, pass.y, pass.low, pass.high, {Ink::blue});
  if (!fail.x.empty()) panel.points_with_errors("fail", fail.x, fail.y, fail.low, fail.high, {Ink::vermilion});
  for (const BatchLimit& limit : table.limits) {
    if (limit.of != name) continue;
    if (std::isfinite(limit.min)) panel.reference(limit.min, "min");
    if (std::isfinite(limit.max)) panel.reference(limit.max, "max");
  }
  return figure;
}

void add_figures(const BatchTable& table, Page& page) {
  std::vector<double> number, days;
  double first = std::numeric_limits<double>::infinity();
  for (const BatchRow& row : table.rows) {
    number.push_back(static_cast<double>(number.size() + 1));
    days.push_back(seconds_of(row.time));
    if (std::isfinite(days.back())) first = std::min(first, days.back());
  }
  for (double& day : days) day = (day - first) / 86400;
  auto quantities = table.parameters();
  quantities.emplace_back("error", "");
  page.section("Over the serial number", false);
  page.paragraph("In the order of the manifest. Bars are standard errors; dashed lines the limits.");
  for (const auto& [name, unit] : quantities) {
    page.figure({"serial_" + name, over(table, number, {"motor", ""}, name, unit), name + " over the motors."});
  }
  if (!std::isfinite(first)) return;
  page.section("Over time");
  for (const auto& [name, unit] : quantities) {
    page.figure({"time_" + name, over(table, days, {"since the first", "days"}, name, unit), name + " over time."});
  }
}

std::string one_line(const std::vector<std::string>& all) {
  std::string out;
  for (const std::string& one : all) out += (out.empty() ? "" : "; ") + one;
  return out;
}

void add_rows(const BatchTable& table, Page& page) {
  std::vector<std::vector<std::string>> wrong, all;
  const auto parameters = table.parameters();
  for (const BatchRow& row : table.rows) {
    const std::string result = row.state == "bad" ? "bad" : row.passes ? "pass" : "fail";
    if (!row.passes)
      wrong.push_back({row.serial, row.time, result, row.state == "bad" ? row.message : one_line(row.beyond)});
    std::vector<std::string> cells{row.serial, row.time, result, row.error() ? pretty(*row.error(), 3) : "-"};
    for (const auto& [name, unit] : parameters) {
      const BatchRow::Value* v = row.find(name);
      cells.push_back(v == nullptr ? "-" : pretty(v->value, 5));
    }
    if (table.work == "diagnose") cells.push_back(row.verdict + (row.missing.empty() ? "" : ": " + row.missing));
    all.push_back(std::move(cells));
  }
  const auto cut = [](std::vector<std::vector<std::string>>& rows) {
    if (rows.size() > longest_list) rows.resize(longest_list);
  };
  if (!wrong.empty()) {
    page.section("What does not pass");
    cut(wrong);
    page.table("Motors beyond a limit, and sessions that could not be used", "llll",
               {"serial", "time", "result", "why"}, wrong);
  }
  page.section("All");
  if (all.size() > longest_list)
    page.paragraph("The first " + std::to_string(longest_list) + "; all are in `table.csv`.");
  cut(all);
  std::vector<std::string> heading{"serial", "time", "result", "error"};
  std::string columns = "lllr";
  for (const auto& [name, unit] : parameters) {
    heading.push_back(name + (unit.empty() ? "" : " [" + unit + "]"));
    columns += 'r';
  }
  if (table.work == "diagnose") {
    heading.push_back("verdict");
    columns += 'l';
  }
  page.table("Each motor", columns, heading, all);
}

}  // namespace

std::string page_of(const BatchTable& table) {
  const std::size_t n = table.rows.size(), passed = table.passed(), bad = table.bad();
  Page page(table.name, std::to_string(n) + " motors: " + std::to_string(passed) + " pass, " +
                            std::to_string(n - passed - bad) + " fail, " + std::to_string(bad) + " bad");
  page.section("Limits", false);
  if (table.limits.empty()) page.paragraph("None was given: whatever could be worked on passes.");
  std::vector<std::vector<std::string>> limits;
  for (const BatchLimit& limit : table.limits) {
    limits.push_back({limit.of, std::isfinite(limit.min) ? pretty(limit.min, 5) : "-",
                      std::isfinite(limit.max) ? pretty(limit.max, 5) : "-"});
  }
  if (!limits.empty()) page.table("What passes", "lrr", {"of", "min", "max"}, limits);
  add_figures(table, page);
  add_rows(table, page);
  return page.html();
}

}  // namespace emtb
