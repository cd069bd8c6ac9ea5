import java.io.File;
import java.nio.file.Files;
import java.util.regex.Matcher;
import java.util.regex.Pattern;
import org.semanticweb.elk.owlapi.ElkReasonerFactory;
import org.semanticweb.HermiT.ReasonerFactory;
import org.semanticweb.owlapi.apibinding.OWLManager;
import org.semanticweb.owlapi.model.*;
import org.semanticweb.owlapi.profiles.*;
import org.semanticweb.owlapi.reasoner.OWLReasoner;
import org.semanticweb.owlapi.util.SimpleIRIMapper;

/** Opens ontologies as Protégé does and prints what the OWL API says, one tab-separated line a finding.
 *  Arguments: the catalog, a comma-separated list of reports (profile, hermit, elk), the files. */
public class OwlApi {
    public static void main(String[] args) throws Exception {
        for (int i = 2; i < args.length; i++) {
            try {
                check(new File(args[0]), args[1], new File(args[i]));
            } catch (Exception e) {
                say(args[i], "error", e.getClass().getSimpleName() + " " + e.getMessage());
            }
        }
    }

    static void check(File catalog, String reports, File file) throws Exception {
        OWLOntologyManager manager = OWLManager.createOWLOntologyManager();
        Pattern entry = Pattern.compile("<uri[^>]*name=\"([^\"]+)\"[^>]*uri=\"([^\"]+)\"");
        Matcher found = entry.matcher(new String(Files.readAllBytes(catalog.toPath()), "UTF-8"));
        while (found.find()) {
            File target = new File(catalog.getParentFile(), found.group(2));
            if (target.exists())
                manager.getIRIMappers().add(new SimpleIRIMapper(IRI.create(found.group(1)), IRI.create(target)));
        }
        OWLOntology ontology = manager.loadOntologyFromOntologyDocument(file);
        say(file, "format", manager.getOntologyFormat(ontology).getKey());
        say(file, "axioms", ontology.getAxiomCount());
        say(file, "imports", ontology.imports().count());
        if (reports.contains("profile")) {
            for (OWLProfile profile : new OWLProfile[] {new OWL2DLProfile(), new OWL2RLProfile()})
                for (OWLProfileViolation violation : profile.checkOntology(ontology).getViolations())
                    say(file, profile.getName(), violation);
        }
        if (reports.contains("hermit"))
            say(file, "HermiT", new ReasonerFactory().createReasoner(ontology).isConsistent());
        if (reports.contains("elk")) {
            OWLReasoner elk = new ElkReasonerFactory().createReasoner(ontology);
            say(file, "ELK", elk.isConsistent());
            for (OWLClass c : elk.getUnsatisfiableClasses().getEntitiesMinusBottom()) say(file, "unsatisfiable", c.getIRI());
        }
    }

    static void say(Object file, String key, Object value) {
        System.out.println(file + "\t" + key + "\t" + String.valueOf(value).replace('\n', ' ').replace('\t', ' '));
    }
}
