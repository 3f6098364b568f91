% Offline execution of programs: transitions and final programs of ConGolog, with fluents that may be unknown.
% A situation is a list of Fluent=Value.

:- dynamic action/4, procedure/2.

% Values of expressions: true, false, unknown, numbers and symbols.

eval(V, _, V) :- atomic(V), !.
eval(fl(F, Args), S, V) :- eval_all(Args, S, Vs), ( memberchk(unknown, Vs) -> V = unknown ; memberchk((F-Vs)=V, S) ).
eval(sum(A, B), S, V) :- both(A, B, S, X, Y, V, V is X + Y).
eval(equal(A, B), S, V) :- both(A, B, S, X, Y, V, truth(X == Y, V)).
eval(unequal(A, B), S, V) :- both(A, B, S, X, Y, V, truth(X \== Y, V)).
eval(less(A, B), S, V) :- both(A, B, S, X, Y, V, truth(X < Y, V)).
eval(at_most(A, B), S, V) :- both(A, B, S, X, Y, V, truth(X =< Y, V)).
eval(neg(A), S, V) :- eval(A, S, X), opposite(X, V).
eval(known(A), S, V) :- eval(A, S, X), truth(X \== unknown, V).
eval(conj(L), S, V) :- eval_all(L, S, Vs), conjunction(Vs, V).
eval(disj(L), S, V) :- eval_all(L, S, Vs), disjunction(Vs, V).
eval(forall_d(X, A), S, V) :- findall(W, instance(X, A, S, W), Vs), conjunction(Vs, V).
eval(exists_d(X, A), S, V) :- findall(W, instance(X, A, S, W), Vs), disjunction(Vs, V).

instance(X, A, S, V) :- member(X, [0, 1, 2]), eval(A, S, V).

eval_all([], _, []).
eval_all([A|As], S, [V|Vs]) :- eval(A, S, V), eval_all(As, S, Vs).

both(A, B, S, X, Y, V, Goal) :- eval(A, S, X), eval(B, S, Y), ( ( X == unknown ; Y == unknown ) -> V = unknown ; Goal ).

truth(Goal, V) :- ( Goal -> V = true ; V = false ).

opposite(true, false).
opposite(false, true).
opposite(unknown, unknown).

conjunction(Vs, V) :- ( memberchk(false, Vs) -> V = false ; memberchk(unknown, Vs) -> V = unknown ; V = true ).
disjunction(Vs, V) :- ( memberchk(true, Vs) -> V = true ; memberchk(unknown, Vs) -> V = unknown ; V = false ).

% Actions: all effects see the situation before; of several on a fluent the first counts.

possible(Name, Args, S) :- action(Name, Args, Possible, _), eval(Possible, S, true).

result(Name, Args, S, S2) :-
    action(Name, Args, _, Effects),
    ( Name == look -> Sensed = [(u-[])=unknown] ; Sensed = [] ),
    findall(W, ( member(E, Effects), write_of(E, S, W) ), Ws),
    append(Sensed, Ws, Writes),
    update(S, Writes, S2).

write_of(effect(none, F, As, Value, If), S, W) :- one_write(F, As, Value, If, S, W).
write_of(effect(all(X), F, As, Value, If), S, W) :- member(X, [0, 1, 2]), one_write(F, As, Value, If, S, W).

one_write(F, As, Value, If, S, (F-Vs)=New) :-
    eval(If, S, C), C \== false,
    eval_all(As, S, Vs), eval(Value, S, V),
    memberchk((F-Vs)=Old, S),
    ( C == unknown, V \== Old -> New = unknown ; New = V ).

update([], _, []).
update([F=Old|S], Writes, [F=New|S2]) :- ( memberchk(F=W, Writes) -> New = W ; New = Old ), update(S, Writes, S2).

% Transitions: program, situation, program after it, and the action or `none`.

trans(test(F), S, nil, none) :- eval(F, S, true).
trans(act(Name, Args), S, nil, Name-Vs) :- eval_all(Args, S, Vs), \+ memberchk(unknown, Vs), possible(Name, Vs, S).
trans(call(Arg), S, P, E) :- body(Arg, S, Body), trans(Body, S, P, E).
trans(seq([A|As]), S, seq([A2|As]), E) :- trans(A, S, A2, E).
trans(seq([A|As]), S, P, E) :- ends(A, S), trans(seq(As), S, P, E).
trans(choice(As), S, P, E) :- member(A, As), trans(A, S, P, E).
trans(pick(X, Vs, A), S, P, E) :- member(V, Vs), copy_term(X-A, V-B), trans(B, S, P, E).
trans(for(X, Vs, A), S, P, E) :- findall(B, ( member(V, Vs), copy_term(X-A, V-B) ), Bs), trans(seq(Bs), S, P, E).
trans(star(A), S, seq([A2, star(A)]), E) :- trans(A, S, A2, E).
trans(if(F, A, _), S, P, E) :- eval(F, S, true), trans(A, S, P, E).
trans(if(F, _, B), S, P, E) :- eval(F, S, false), trans(B, S, P, E).
trans(while(F, A), S, seq([A2, while(F, A)]), E) :- eval(F, S, true), trans(A, S, A2, E).
trans(both(A, B), S, both(A2, B), E) :- trans(A, S, A2, E).
trans(both(A, B), S, both(A, B2), E) :- trans(B, S, B2, E).
trans(prior(A, B), S, prior(A2, B), E) :- trans(A, S, A2, E).
trans(prior(A, B), S, prior(A, B2), E) :- \+ trans(A, S, _, _), trans(B, S, B2, E).
trans(each(A), S, both(A2, each(A)), E) :- trans(A, S, A2, E).
trans(interrupt(F, A), S, seq([A2, interrupt(F, A)]), E) :- eval(F, S, true), trans(A, S, A2, E).
trans(search(A), S, P, E) :- trans(A, S, P, E).

body(Arg, S, Body) :- eval(Arg, S, V), V \== unknown, procedure(V, Body).

ends(P, S) :- \+ \+ final(P, S).

final(nil, _).
final(call(Arg), S) :- body(Arg, S, Body), final(Body, S).
final(seq([]), _).
final(seq([A|As]), S) :- final(A, S), final(seq(As), S).
final(choice(As), S) :- member(A, As), final(A, S).
final(pick(X, Vs, A), S) :- member(V, Vs), copy_term(X-A, V-B), final(B, S).
final(for(X, Vs, A), S) :- findall(B, ( member(V, Vs), copy_term(X-A, V-B) ), Bs), final(seq(Bs), S).
final(star(_), _).
final(if(F, A, _), S) :- eval(F, S, true), final(A, S).
final(if(F, _, B), S) :- eval(F, S, false), final(B, S).
final(while(F, _), S) :- eval(F, S, false).
final(while(_, A), S) :- final(A, S).
final(both(A, B), S) :- final(A, S), final(B, S).
final(prior(A, B), S) :- final(A, S), final(B, S).
final(each(_), _).
final(interrupt(F, _), S) :- \+ eval(F, S, true).
final(search(A), S) :- final(A, S).

% Do: the actions of all paths of at most so many transitions.

do(P, S, _, []) :- ends(P, S).
do(P, S, Depth, Actions) :-
    Depth > 0, Less is Depth - 1,
    trans(P, S, P2, E),
    ( E = Name-Args -> result(Name, Args, S, S2), Actions = [E|Rest] ; S2 = S, Actions = Rest ),
    do(P2, S2, Less, Rest).

run(Depth) :-
    forall(problem(Number, Initial, Actions, sub(X, Sub), Main),
           ( retractall(action(_, _, _, _)), retractall(procedure(_, _)),
             forall(member(A, Actions), assertz(A)), assertz(procedure(X, Sub)),
             format("problem ~w~n", [Number]),
             forall(do(Main, Initial, Depth, Path), print_path(Path)) )).

print_path(Path) :- forall(member(Name-Args, Path), print_action(Name, Args)), nl.

print_action(Name, []) :- format("~w ", [Name]).
print_action(Name, [Arg]) :- format("~w(~w) ", [Name, Arg]).
