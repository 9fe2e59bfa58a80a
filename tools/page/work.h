#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "analysis/diagnose/diagnose.h"
#include "analysis/discover/discover.h"
#include "analysis/record/dataset.h"
#include "model/model.h"
#include "session/mapping.h"
#include "session/session.h"

namespace emtb::page {

using json = nlohmann::json;

/// What `emtb page` was called with.
struct Files {
  std::string model, map;
  std::vector<std::string> sessions, held_out;
  std::filesystem::path state;   ///< the folder where work is kept
  std::filesystem::path socket;  ///< of the daemon; empty: none
  std::string command;

  bool any() const { return !model.empty(); }
  std::filesystem::path imports() const { return state / "imports"; }  ///< where what comes from a page goes
};

/// A model, the runs that it is held against, and every change of it with undo and redo.
///
/// Each change is written at once to a file of its own in the state folder, named after the model's text and the
/// sessions named on the command line: a reload, a restart or a dead worker loses nothing. The model's file is never
/// written.
class Work {
 public:
  using Progress = std::function<void(double share, const std::string& doing)>;

  /// Reads the files, and what was saved of earlier work on them. @throws Error where they cannot be read
  explicit Work(Files files);

  json state() const;

  void set(const json& params);
  void lock(const json& params);
  void fit();
  void add(std::size_t effect);
  void add_formula(const json& formula);
  void remove(const std::string& effect);
  void undo();
  void redo();

  /// Uses a session otherwise. @param as train, held_out, or empty: not at all
  void use(const std::string& session, const std::string& as);
  std::string use_of(const std::filesystem::path& session) const;

  json simulate(const json& params) const;
  json missing() const;
  json compare() const;
  json score_formula(const json& formula) const;
  json diagnose(const Progress& progress);
  json report(const Progress& progress);
  json exported(const json& params) const;

  const Model& model() const { return now_.model; }
  const Files& files() const { return files_; }
  const Mapping& mapping() const { return mapping_; }

 private:
  struct Step {
    std::string added;  ///< empty: the model as given
    double train = 0, held_out = 0;
  };
  struct State {
    Model model;
    std::vector<Step> steps;
    std::vector<std::string> at_bound;
    std::string label;  ///< of what made it
  };

  void load_runs();
  void change(State next, const std::string& label);
  void refit(const Model& start, State& next);
  void count_steps_anew();
  Step step_of(const std::string& added, const Model& model) const;
  void refuse_unless_fit_for_fitting() const;
  const Diagnosis& diagnosis(const Progress& progress);
  std::string question() const;
  void take_floors_of(const Diagnosis& d);
  void take_fit_of(const Diagnosis& d);
  const Record& record(const std::string& id) const;
  bool held_out(std::size_t run) const { return run >= data_.train.size(); }
  std::vector<const Record*> records() const;
  Model with_formula(const json& formula) const;
  void save() const;
  void restore();

  const Files files_;
  Mapping mapping_;
  std::vector<std::string> train_specs_, held_out_specs_;
  std::vector<Run> train_, held_out_;  // without a gap
  std::vector<std::string> sessions_;  // of each run, in the order of records()
  std::string findings_;               // why nothing may be fitted; empty: it may
  Model given_;
  Dataset data_;
  Noise quieter_;  // floors of which a diagnosis took what has a law; empty: they are as the runs tell
  State now_;
  std::vector<State> past_, future_;
  std::filesystem::path file_;
  std::unique_ptr<Diagnosis> diagnosis_;
  std::unique_ptr<Discovery> rest_;  // what is left of it without a name; null: nothing
  std::string diagnosed_;            // the question() that it answers
};

}  // namespace emtb::page
