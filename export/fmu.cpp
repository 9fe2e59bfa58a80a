#include "export/fmu.h"

#include <cstdint>
#include <set>
#include <sstream>

#include "emtb/version.h"
#include "export/export_text.h"
#include "export/fmu_source.h"
#include "export/step_text.h"

namespace emtb {
namespace {

/// Of a text in two halves: the same model has the same, another one another.
std::string guid_of(const std::string& text) {
  std::ostringstream out;
  out << std::hex;
  for (const std::uint64_t seed : {0xcbf29ce484222325ULL, 0x84222325cbf29ce4ULL}) {
    std::uint64_t hash = seed;
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;  // FNV-1a
    out.width(16);
    out.fill('0');
    out << hash;
  }
  return "{" + out.str() + "}";
}

std::string in_xml(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

struct Variable {
  std::string name, about, unit, kind;  ///< kind: its attributes of causality and variability
  std::string start;                    ///< empty: computed
  std::string place;                    ///< in the component: `u`, `p.R_a`, `s.omega`
};

/// Inputs, outputs, parameters: a variable's value reference is its place in this list.
std::vector<Variable> variables_of(const ExportedEquations& x) {
  const std::string input = "causality=\"input\" variability=\"continuous\"";
  const std::string output = "causality=\"output\" variability=\"continuous\" initial=\"calculated\"";
  std::vector<Variable> list{
      {input_name(x.input), "held over a communication step", input_unit(x.input), input, "0", "u"},
      {"load", "torque that a load takes", "N m", input, "0", "load"}};
  for (const StateText& s : states_of(x)) {
    for (const char* shown : {"omega", "theta", "i_a", "e_a"}) {
      // The voltage that is the input is no output as well.
      if (s.name == shown && s.name != list[0].name)
        list.push_back({s.name, s.about, s.unit, output, "", "s." + s.name});
    }
  }
  for (const ExportedParameter& p : x.parameters) {
    list.push_back({p.name, p.about, p.unit, "causality=\"parameter\" variability=\"tunable\" initial=\"exact\"",
                    exact(p.value), "p." + p.name});
  }
  return list;
}

std::string description(const ExportedEquations& x, const std::vector<Variable>& variables,
                        const std::string& identifier, const std::string& guid) {
  std::ostringstream out;
  out << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\" modelName=\""
      << in_xml(x.model) << "\" guid=\"" << guid << "\" generationTool=\"emtb " << version
      << "\" variableNamingConvention=\"flat\" numberOfEventIndicators=\"0\">\n"
      << "  <CoSimulation modelIdentifier=\"" << identifier
      << "\" canHandleVariableCommunicationStepSize=\"true\" canGetAndSetFMUstate=\"true\">\n"
      << "    <SourceFiles>\n      <File name=\"" << identifier << ".c\"/>\n    </SourceFiles>\n  </CoSimulation>\n"
      << "  <UnitDefinitions>\n";
  std::set<std::string> units;
  for (const Variable& v : variables) units.insert(v.unit);
  for (const std::string& unit : units) out << "    <Unit name=\"" << in_xml(unit) << "\"/>\n";
  out << "  </UnitDefinitions>\n  <DefaultExperiment startTime=\"0\" stepSize=\"0.001\"/>\n  <ModelVariables>\n";
  for (std::size_t k = 0; k < variables.size(); ++k) {
    const Variable& v = variables[k];
    out << "    <ScalarVariable name=\"" << v.name << "\" valueReference=\"" << k << "\" description=\""
        << in_xml(v.about) << "\" " << v.kind << "><Real unit=\"" << in_xml(v.unit) << "\"";
    if (!v.start.empty()) out << " start=\"" << v.start << "\"";
    out << "/></ScalarVariable>\n";
  }
  out << "  </ModelVariables>\n  <ModelStructure>\n";
  for (const char* list : {"Outputs", "InitialUnknowns"}) {
    out << "    <" << list << ">\n";
    for (std::size_t k = 0; k < variables.size(); ++k) {
      if (variables[k].start.empty()) out << "      <Unknown index=\"" << k + 1 << "\"/>\n";
    }
    out << "    </" << list << ">\n";
  }
  out << "  </ModelStructure>\n</fmiModelDescription>\n";
  return out.str();
}

/// What of the C source depends on the model: where each variable stands in a component.
std::string places(const std::vector<Variable>& variables, const std::string& guid) {
  std::ostringstream out;
  out << "#define GUID \"" << guid << "\"\n#define VARIABLES " << variables.size() << "\n"
      << "static double *place(component *c, unsigned k) {\n  switch (k) {\n";
  for (std::size_t k = 0; k < variables.size(); ++k)
    out << "    case " << k << ": return &c->" << variables[k].place << ";\n";
  out << "    default: return 0;\n  }\n}\n/* outputs may only be read */\nstatic int may_set(unsigned k) {\n  switch "
         "(k) {\n";
  for (std::size_t k = 0; k < variables.size(); ++k) {
    if (variables[k].start.empty()) out << "    case " << k << ":\n";
  }
  out << "      return 0;\n    default: return 1;\n  }\n}\n";
  return out.str();
}

}  // namespace

Fmu fmu_of(const ExportedEquations& x, const std::string& identifier) {
  const std::vector<Variable> variables = variables_of(x);
  const std::string header = c_header(x);
  const std::string guid = guid_of(header);
  std::string source = "/* The motor model `" + x.model + "` as an FMU 2.0 for co-simulation, written by emtb " +
                       std::string(version) + ". */\n" + fmu_source_head + places(variables, guid) +
                       fmu_source_functions;
  return {.identifier = identifier,
          .files = {{"modelDescription.xml", description(x, variables, identifier, guid)},
                    {"sources/emtb_model.h", header},
                    {"sources/" + identifier + ".c", source}},
          .source = "sources/" + identifier + ".c",
          .library = "binaries/linux64/" + identifier + ".so"};
}

}  // namespace emtb
