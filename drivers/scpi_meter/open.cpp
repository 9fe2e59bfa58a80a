#include "drivers/scpi_meter/open.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "drivers/scpi_meter/answer.h"
#include "drivers/serial_meter/models.h"
#include "drivers/serial_meter/open.h"
#include "drivers/settings.h"

namespace emtb::scpi_meter {
namespace {

using serial_meter::Coupling;
using serial_meter::Model;
using serial_meter::Protocol;
using serial_meter::Quantity;

/// A model that a bench file describes, and the texts that it points into.
struct Described {
  std::string name, query, mode_query, barrier;
  std::vector<std::string> set_up;
  std::vector<std::string_view> requests;
  Protocol protocol;
  Model model;
};

/// One line of text for the meter, as a person wrote it.
std::string command(const YamlMap& yaml, std::string_view key, const std::string& text, const std::string& ending) {
  constexpr std::size_t longest = 200;
  const bool printable = std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; });
  if (text.empty() || text.size() > longest || !printable) {
    yaml.fail(key, "must be 1 to 200 characters of ASCII, without its ending");
  }
  return text + ending;
}

std::string read_ending(const YamlMap& device) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 3> endings{
      {{"lf", "\n"}, {"cr", "\r"}, {"crlf", "\r\n"}}};
  const std::string word = device.text_or("ending", "lf");
  const auto found = std::ranges::find(endings, word, [](const auto& one) { return one.first; });
  if (found == endings.end()) device.fail("ending", "is `" + word + "`. Known: lf, cr, crlf");
  return std::string(found->second);
}

Place read_place(const YamlMap& device) {
  const auto parse = device.map_if("parse");
  if (!parse) return Place::field(1, ',');
  parse->only({"field", "separator", "regex"});
  if (parse->has("regex")) {
    if (parse->has("field") || parse->has("separator")) parse->fail("regex", "stands for itself: remove field");
    std::string why;
    auto place = Place::pattern(parse->text("regex"), why);
    if (!place) parse->fail("regex", "cannot be read: " + why);
    return *place;
  }
  const std::string separator = parse->text_or("separator", ",");
  if (separator.size() != 1) parse->fail("separator", "must be one character");
  return Place::field(static_cast<std::size_t>(whole_number(*parse, "field", 1, 100, 1)), separator[0]);
}

std::shared_ptr<Described> read_description(const YamlMap& device) {
  auto described = std::make_shared<Described>();
  const std::string ending = read_ending(device);
  described->name = device.text("query");
  described->query = command(device, "query", described->name, ending);
  if (device.has("setup")) {
    for (const std::string& line : device.texts("setup")) {
      described->set_up.push_back(command(device, "setup", line, ending));
    }
  }
  described->barrier = "*IDN?" + ending;
  Answers answers{.place = read_place(device)};
  answers.overload = device.within_or("overload", 1e-12, unbounded, answers.overload);
  answers.identity = device.text_or("identity", "");
  if (const auto mode = device.map_if("mode")) {
    mode->only({"query", "answer"});
    described->mode_query = command(*mode, "query", mode->text("query"), ending);
    answers.mode = mode->text("answer");
  }
  described->requests.emplace_back(described->query);
  if (!described->mode_query.empty()) described->requests.emplace_back(described->mode_query);
  described->protocol.name = "SCPI";
  described->protocol.find = [answers](std::string_view received) {
    return serial_meter::find_line(received, [&](std::string_view line) { return answers.classify(line); });
  };
  described->protocol.requests = described->requests;
  described->protocol.barrier = described->barrier;
  described->protocol.set_up = [lines = described->set_up](const serial_meter::Function&, double, double) {
    return lines;
  };
  described->model.name = "scpi";
  described->model.maker = "SCPI";
  described->model.protocol = &described->protocol;
  return described;
}

}  // namespace

serial_meter::MeterSettings read_settings(const YamlMap& device) {
  device.only({"driver",     "port",  "line",     "dtr",    "rts",     "ending", "setup", "identity",
               "query",      "parse", "overload", "mode",   "signal",  "unit",   "scale", "offset",
               "resolution", "range", "period",   "window", "latency", "timeout"});
  const auto described = read_description(device);
  serial_meter::MeterSettings settings{.port = device.text("port"),
                                       .model = std::shared_ptr<const Model>(described, &described->model),
                                       .line = serial_meter::read_line_settings(device, {})};
  settings.signal = measured_signal(device, "signal", device.text("signal"));
  const Scaling scaling = read_scaling(settings.signal, device);
  settings.function = {
      .name = described->name, .quantity = Quantity::unsaid, .coupling = Coupling::unsaid, .unit = "of the answer"};
  settings.scale = scaling.scale;
  settings.offset = scaling.offset;
  settings.file_unit = scaling.unit;
  settings.file_zero = scaling.zero;
  settings.digit = scaling.digit;
  settings.reach = scaling.range;
  settings.period = device.has("period") ? device.positive("period") : 0.5;
  settings.window = device.within_or("window", 0, unbounded, settings.period);
  settings.latency = device.within_or("latency", 0, unbounded, 0);
  settings.timeout = device.has("timeout") ? device.positive("timeout") : std::max(1.5, 3 * settings.period);
  return settings;
}

OpenedDevice open_meter(const OpenRequest& request) { return open_input<serial_meter::Meter>(request, read_settings); }

}  // namespace emtb::scpi_meter
