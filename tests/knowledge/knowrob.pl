% Load an export as KnowRob's Prolog side does, and print the number of triples and every reified relation:
% swipl -q tests/knowledge/knowrob.pl FILE
:- use_module(library(semweb/rdf_db)).
:- use_module(library(semweb/rdfs)).
:- rdf_register_prefix(knowrob, 'http://knowrob.org/kb/knowrob.owl#').
:- initialization(main, main).

main([File]) :-
    rdf_load(File, [format(xml), silent(true)]),
    rdf_statistics(triples(Number)),
    writeln(Number),
    forall(relation(Subject, Object, Confidence),
           ( write_canonical([Subject, Object, Confidence]), nl )).

relation(Subject, Object, Confidence) :-
    rdfs_individual_of(Relation, knowrob:'ReifiedRelation'),
    rdf(Relation, knowrob:hasSubject, Subject),
    rdf(Relation, knowrob:hasObject, Object),
    rdf(Relation, knowrob:hasConfidence, literal(type(_, Confidence))).
