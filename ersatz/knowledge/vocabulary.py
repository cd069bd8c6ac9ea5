"""The terms of `ontology/ersatz.ttl` (and the few foreign ones we use) as Python names."""

from typing import Final

from pyoxigraph import NamedNode

ERSATZ: Final = "https://w3id.org/ersatz#"
KB: Final = "https://w3id.org/ersatz/kb#"
RDF: Final = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
RDFS: Final = "http://www.w3.org/2000/01/rdf-schema#"
OWL: Final = "http://www.w3.org/2002/07/owl#"
XSD: Final = "http://www.w3.org/2001/XMLSchema#"
PROV: Final = "http://www.w3.org/ns/prov#"
DCTERMS: Final = "http://purl.org/dc/terms/"

PREFIXES: Final = {
    "ersatz": ERSATZ,
    "kb": KB,
    "rdf": RDF,
    "rdfs": RDFS,
    "owl": OWL,
    "xsd": XSD,
    "prov": PROV,
    "dcterms": DCTERMS,
}
"""What files and queries of ERSATZ abbreviate."""

ONTOLOGY: Final = NamedNode("https://w3id.org/ersatz")
KB_ONTOLOGY: Final = NamedNode("https://w3id.org/ersatz/kb")
BUILD: Final = NamedNode(KB + "build_1")
"""The build record of a knowledge base."""

FORMAT_VERSION: Final = 1
"""Raised whenever an older ERSATZ could misread a knowledge base."""


def term(name: str) -> NamedNode:
    """Return the ERSATZ term of this local name."""
    return NamedNode(ERSATZ + name)


# Classes
OBJECT: Final = term("Object")
PROPERTY: Final = term("Property")
PHYSICAL_PROPERTY: Final = term("PhysicalProperty")
FUNCTIONAL_PROPERTY: Final = term("FunctionalProperty")
AXIS: Final = term("Axis")
QUALITY_CLASS: Final = term("Quality")
PHYSICAL_QUALITY: Final = term("PhysicalQuality")
FUNCTIONAL_QUALITY: Final = term("FunctionalQuality")
COORDINATE_CLASS: Final = term("Coordinate")
NORM_ELEMENT: Final = term("NormElement")
MODEL: Final = term("Model")
CLASS_MODEL: Final = term("ClassModel")
FUNCTION_MODEL: Final = term("FunctionModel")
SUBSTITUTION_MODEL: Final = term("SubstitutionModel")
STATEMENT: Final = term("Statement")
ENTRY: Final = term("Entry")
MEASUREMENT: Final = term("Measurement")
CANDIDATE_CLASS: Final = term("Candidate")
RELEVANCE: Final = term("Relevance")
ASSIGNMENT: Final = term("Assignment")
KNOWLEDGE_BUILD: Final = term("KnowledgeBuild")
SOURCE_CLASS: Final = term("Source")
ORIGIN_CLASS: Final = term("Origin")

# Object properties
HOLDS: Final = term("holds")
HAS_MEASUREMENT: Final = term("hasMeasurement")
MEASURED_PROPERTY: Final = term("measuredProperty")
ASSIGNED_QUALITY: Final = term("assignedQuality")
HAS_ASSIGNMENT: Final = term("hasAssignment")
ORIGIN: Final = term("origin")
SOURCE: Final = term("source")
USED_SOURCE: Final = term("usedSource")
HAS_AXIS: Final = term("hasAxis")
HAS_COORDINATE: Final = term("hasCoordinate")
ON_AXIS: Final = term("onAxis")
QUALITY_OF: Final = term("qualityOf")
HAS_NORM_ELEMENT: Final = term("hasNormElement")
ROW_AXIS: Final = term("rowAxis")
COLUMN_AXIS: Final = term("columnAxis")
HAS_ENTRY: Final = term("hasEntry")
QUALITY: Final = term("quality")
FOR_FUNCTION: Final = term("forFunction")
REPRESENTATIVE_QUALITY: Final = term("representativeQuality")
MISSING_TOOL: Final = term("missingTool")
RELEVANT_PHYSICAL_QUALITY: Final = term("relevantPhysicalQuality")
RELEVANT_FUNCTIONAL_QUALITY: Final = term("relevantFunctionalQuality")
HAS_CANDIDATE: Final = term("hasCandidate")
HAS_RELEVANCE: Final = term("hasRelevance")
RELEVANT_QUALITY: Final = term("relevantQuality")
CANDIDATE: Final = term("candidate")
SHARED: Final = term("shared")
LACKING: Final = term("lacking")
EXTRA: Final = term("extra")
SUBSTITUTE: Final = term("substitute")
NON_SUBSTITUTE: Final = term("nonSubstitute")

# Data properties
RANK: Final = term("rank")
POSITION: Final = term("position")
CENTROID: Final = term("centroid")
LOWER_BOUND: Final = term("lowerBound")
UPPER_BOUND: Final = term("upperBound")
RAW_VALUE: Final = term("rawValue")
COORDINATE: Final = term("coordinate")
FUZZIFIER: Final = term("fuzzifier")
ELEMENT: Final = term("element")
COUNT: Final = term("count")
TOTAL: Final = term("total")
PROPORTION: Final = term("proportion")
DEGREE: Final = term("degree")
SIMILARITY: Final = term("similarity")
THETA: Final = term("theta")
PHI: Final = term("phi")
RELEVANCE_PHI: Final = term("relevancePhi")
ACCEPTED: Final = term("accepted")
ACCEPTANCE_PROBABILITY: Final = term("acceptanceProbability")
BEST_PROBABILITY: Final = term("bestProbability")
SIMILARITY_LOW: Final = term("similarityLow")
SIMILARITY_HIGH: Final = term("similarityHigh")
CREDIBLE_LEVEL: Final = term("credibleLevel")
DRAWS: Final = term("draws")
PRIOR_COUNT: Final = term("priorCount")
RELEVANCE_WEIGHT: Final = term("relevanceWeight")
INSTANCE_COUNT: Final = term("instanceCount")
OBSERVATION: Final = term("observation")
UNIT: Final = term("unit")
SEED: Final = term("seed")
CLUSTERS: Final = term("clusters")
FORMAT: Final = term("formatVersion")
OBSERVATION_UNIT: Final = term("observationUnit")
METHOD: Final = term("method")
REVISION: Final = term("revision")
SETTINGS: Final = term("settings")
SHA256: Final = term("sha256")
FILE_NAME: Final = term("fileName")
CREDIT: Final = term("credit")
SOFTWARE_VERSION: Final = term("softwareVersion")

# Annotation properties
DESCRIBES_CLASS: Final = term("describesClass")
ADJECTIVE: Final = term("adjective")
ORIENTATION: Final = term("orientation")

# Individuals
MACHINE: Final = term("machine")
HUMAN: Final = term("human")
SYNTHETIC: Final = term("synthetic")

# Foreign terms
TYPE: Final = NamedNode(RDF + "type")
LABEL: Final = NamedNode(RDFS + "label")
COMMENT: Final = NamedNode(RDFS + "comment")
SUBCLASS_OF: Final = NamedNode(RDFS + "subClassOf")
OWL_CLASS: Final = NamedNode(OWL + "Class")
NAMED_INDIVIDUAL: Final = NamedNode(OWL + "NamedIndividual")
OWL_ONTOLOGY: Final = NamedNode(OWL + "Ontology")
IMPORTS: Final = NamedNode(OWL + "imports")
WAS_GENERATED_BY: Final = NamedNode(PROV + "wasGeneratedBy")
WAS_DERIVED_FROM: Final = NamedNode(PROV + "wasDerivedFrom")
ENDED_AT: Final = NamedNode(PROV + "endedAtTime")
TITLE: Final = NamedNode(DCTERMS + "title")
