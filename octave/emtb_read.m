function [runs, events] = emtb_read (path)
  % RUNS = emtb_read (PATH): the runs of a session of emtb, .h5 or .mat, in Octave.
  %
  %   runs = emtb_read ("staircase.h5");
  %   plot (runs{1}.omega.t, runs{1}.omega.value);
  %
  % Each signal has t [s], from the start of its run, and value, in SI units. EVENTS has t [s] of the file, code
  % and text; in a .h5 the text is a matrix of characters.
  x = load (path);
  events = struct ("t", [], "code", [], "text", []);
  if (isfield (x, "events"))
    events = x.events;
  end
  if (isfield (x, "runs"))  % a .mat
    runs = {x.runs.signals};
    return
  end
  begins = sort (events.t(events.code == 1));  % an event of code 1 marks where a run begins
  if (numel (begins) < 2)
    begins = 0;
  end
  begins(1) = 0;  % wherever its mark stands
  ends = [begins(2:end)(:); Inf];
  for k = 1:numel (begins)
    run = struct ();
    for name = fieldnames (x.signals)'
      signal = x.signals.(name{1});
      within = signal.t < ends(k) & (k == 1 | signal.t >= begins(k));
      if (any (within))
        run.(name{1}) = struct ("t", signal.t(within)(:) - begins(k), "value", signal.value(within)(:));
      end
    end
    runs{k} = run;
  end
end
