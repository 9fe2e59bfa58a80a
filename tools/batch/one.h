#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/batch/manifest.h"

namespace emtb {

/// Tells whether a result that lies there is that of the same question: the work, the model, the mapping, the sessions
/// as they stand, and this version of emtb.
std::string key_of(const Manifest& manifest, const BatchItem& item);

/// Does the work of one item. What is wrong with its sessions or its model is a result, too: `state` is `bad` then, and
/// `message` says why. The same on every machine of a kind: no time, no rank, no path but those of the manifest.
nlohmann::ordered_json work_on(const Manifest& manifest, const BatchItem& item, const std::string& key);

/// The result of an item at which processes die.
nlohmann::ordered_json died_at(const BatchItem& item, const std::string& key, int times);

}  // namespace emtb
