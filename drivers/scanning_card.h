#pragma once

#include <memory>

#include "drivers/card_input.h"
#include "drivers/card_output.h"
#include "drivers/driver.h"

namespace emtb {

/// Opens a card in real time: its output, where that drives the reference, and its inputs, where they are wanted.
/// @tparam Inputs ScannedInputs, made of what `read_input` reads of the device's entry
/// @tparam Converter CardConverter, made of what `read_output` reads of `reference`, with limits and read_back
template <class Inputs, class Converter, class ReadInput, class ReadOutput>
OpenedDevice open_scanning_card(const OpenRequest& request, ReadInput read_input, ReadOutput read_output) {
  request.need_real_time();
  const auto input = read_input(request.device.yaml, request.bench.rate);
  OpenedDevice opened;
  // The output first: whatever else may be wrong with the card, the reference is safe by then.
  if (request.drives_reference()) {
    const auto output = read_output(request.bench.reference, input.card);
    opened.output = std::make_unique<CardOutput>(request.device.name, std::make_unique<Converter>(output),
                                                 output.limits, output.read_back);
  }
  if (request.output_only) return opened;
  opened.input = std::make_unique<CardInput>(request.device.name, request.clock, std::make_unique<Inputs>(input));
  return opened;
}

/// The check of such a card.
template <class ReadInput, class ReadOutput>
void check_scanning_card(const OpenRequest& request, ReadInput read_input, ReadOutput read_output) {
  request.need_real_time();
  const auto input = read_input(request.device.yaml, request.bench.rate);
  if (request.drives_reference()) read_output(request.bench.reference, input.card);
}

}  // namespace emtb
